//! Values in, figures out: one function for each published figure, which writes `STEM.svg` and `STEM.png`.
//!
//! The crate knows numbers and their uncertainties, not where they come from: SI units go in; millimetres, milliseconds
//! and percent appear on the page only. A figure is first laid out as a list of shapes in millimetres (`drawing`), at the
//! width of one or two columns of a journal, and that list is then handed to plotters' SVG and bitmap backends. So both
//! files show the same page, the layout can be tested without reading pixels, and plotters' whole-pixel coordinates do not
//! limit it: the SVG grid is a hundredth of a millimetre, the bitmap is averaged down from three times its resolution.
//!
//! Text comes from a built-in typeface, so a machine without fonts draws the same bytes. Colours are Okabe and Ito's, and
//! every line also differs by its dashes, every marker by its shape. What was not measured is left out or hatched; a panel
//! without any value says "no data"; an input that makes no sense is a [`FigureError`].
//!
//! Compressive strain is drawn upwards: figures show -u_n.

mod colour;
mod coverage;
mod dispersion;
mod displacements;
mod drawing;
mod error;
mod extremes;
mod field_map;
mod front_width;
mod geometry;
mod group_velocity;
mod heat_map;
mod legend;
mod map_row;
mod output;
mod peak_energy;
mod peak_trace;
mod plot;
mod png;
mod residual_map;
mod scale;
mod series;
mod strain_map;
mod strain_profiles;
mod svg;
mod tail_spectrum;
mod ticks;
mod trade_off;
mod typeface;

pub use coverage::{CoverageRow, coverage};
pub use dispersion::{DispersionPanel, dispersion};
pub use displacements::{BodyMotion, PointMotion, displacements, tracks};
pub use error::FigureError;
pub use extremes::{ExtremeRow, extremes};
pub use field_map::{FieldMap, FieldPanel, field_map};
pub use front_width::{FrontPulse, FrontWidth, front_width};
pub use group_velocity::{GroupVelocities, group_velocity, group_velocity_by_particles};
pub use peak_energy::{EnergyShares, PeakEnergy, peak_energy};
pub use peak_trace::{PeakFit, PeakTrace, peak_trace};
pub use residual_map::{ResidualMapPanel, residual_map};
pub use series::{Origin, Point, Series};
pub use strain_map::{StrainMapPanel, strain_map};
pub use strain_profiles::{ProfilePanel, strain_profiles};
pub use tail_spectrum::{FrequencyMark, GapSpectrum, TailSpectrum, tail_spectrum};
pub use trade_off::{TradeOff, TradeOffPoint, trade_off};
