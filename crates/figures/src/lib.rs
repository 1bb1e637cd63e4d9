//! Values in, figures out: what each published figure shows, drawn as SVG, PNG and PDF, with its numbers as a table.
//!
//! The crate knows numbers and their uncertainties, not where they come from: SI units go in; millimetres, milliseconds
//! and percent appear on the page only. Compressive strain is drawn upwards: figures show -u_n.
//!
//! What can be drawn implements [`Draw`]: it becomes a [`Figure`] in a [`Style`], which writes its files ([`Format`]) and gives
//! the numbers that it shows ([`DataSet`]). A function for each figure does so in the default style, writes `STEM.svg`, `STEM.png` and the
//! numbers of curves, and keeps what was drawn, a [`Picture`], to be drawn again.
//!
//! ```
//! use chainwave_figures::{Draw, Format, PeakTrace, Style};
//! use chainwave_measurement::Estimate;
//!
//! let peaks = (1..=25).map(|n| (f64::from(n), Estimate::new(6e-4 * f64::from(n), 2e-6))).collect();
//! let trace = PeakTrace { peaks, pitch_m: 0.03, fit: None };
//! let figure = trace.draw(&Style::default())?;
//! assert_eq!(figure.data()[0].rows.len(), 25);
//! assert!(figure.bytes(Format::Svg)?.starts_with(b"<svg"));
//! # Ok::<(), chainwave_figures::FigureError>(())
//! ```
//!
//! A figure is first laid out as a list of marks in millimetres (`drawing`), at the width of one or two columns of a journal;
//! plotters' coordinates place values on its axes and its ticks. Three small writers turn the list into files, so all show the
//! same page, and the layout is tested without reading pixels. Letters are outlines of a built-in typeface: every viewer draws
//! them alike, and each label of an SVG carries its words. Maps are pictures inside, so no viewer shows seams between cells.
//!
//! The experiment and each model have one colour in all figures, whose grey values differ as well; lines also differ by dashes
//! and markers by shape. What was not measured is left out or hatched, and a panel without any value says "no data". An input
//! that makes no sense is a [`FigureError`].

mod colour;
mod contact_curve;
mod coverage;
mod data;
mod dispersion;
mod displacements;
mod drawing;
mod error;
mod extremes;
mod field_map;
mod figure;
mod files;
mod frame_sheet;
mod front_width;
mod geometry;
mod group_velocity;
mod heat_map;
mod inset;
mod legend;
mod long_chain;
mod map_row;
mod marked_frame;
mod names;
mod pdf;
mod peak_energy;
mod peak_trace;
mod picture;
mod plot;
mod png;
mod residual_map;
mod rich_text;
mod scale;
mod series;
mod strain_map;
mod strain_profiles;
mod stroke;
mod style;
mod svg;
mod tail_spectrum;
mod ticks;
mod trade_off;
mod typeface;

pub use contact_curve::ContactCurve;
pub use coverage::{CoverageCount, CoverageRow};
pub use data::{CSV_COLUMNS, DataRow, DataSet};
pub use dispersion::DispersionPanel;
pub use displacements::{BodyMotion, PointMotion, RecordingMotion};
pub use error::FigureError;
pub use extremes::ExtremeRow;
pub use field_map::{FieldMap, FieldPanel};
pub use figure::{Draw, Figure, Format};
pub use files::{
    camera_motion, contact_curve, coverage, dispersion, displacements, extremes, field_map, files_of,
    front_width, group_velocity, group_velocity_by_particles, long_chain, marked_frame, peak_energy,
    peak_trace, residual_map, right_halves, strain_map, strain_profiles, tail_spectrum, tracks, trade_off,
};
pub use frame_sheet::{FrameSheet, NamedFrame};
pub use front_width::{FrontPulse, FrontWidth, RightHalves};
pub use group_velocity::{Against, GroupVelocities, GroupVelocityFigure};
pub use long_chain::LongChain;
pub use marked_frame::{MarkedFrame, MarkedSubset};
pub use peak_energy::{EnergyShares, PeakEnergy};
pub use peak_trace::{PeakCurve, PeakFit, PeakTrace};
pub use picture::Picture;
pub use residual_map::ResidualMapPanel;
pub use series::{DataPoint, Origin, Series};
pub use strain_map::StrainMapPanel;
pub use strain_profiles::ProfilePanel;
pub use style::{ColourMap, DecimalSign, Style};
pub use tail_spectrum::{FrequencyMark, GapSpectrum, TailSpectrum};
pub use trade_off::{TradeOff, TradeOffPoint};
