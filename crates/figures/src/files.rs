//! Each figure in the default style, as files: `STEM.svg`, `STEM.png`, the numbers of curves as `STEM.csv`, and what was drawn, to be drawn again.

use std::path::{Path, PathBuf};

use crate::figure::{Draw, Format, put, with_ending};
use crate::picture::Picture;
use crate::{
    Against, BodyMotion, ContactCurve, CoverageRow, DispersionPanel, ExtremeRow, FieldMap, FigureError,
    FrontWidth, GroupVelocities, GroupVelocityFigure, LongChain, MarkedFrame, PeakEnergy, PeakTrace,
    PointMotion, ProfilePanel, RecordingMotion, ResidualMapPanel, RightHalves, StrainMapPanel, Style,
    TailSpectrum, TradeOff,
};

/// The files that a figure of curves is written to; one of a map writes all of them but `STEM.csv`.
pub fn files_of(stem: &Path) -> [PathBuf; 4] {
    let [svg, png, csv] = [Format::Svg, Format::Png, Format::Csv].map(Format::ending);
    [svg, png, csv, Picture::ENDING].map(|ending| with_ending(stem, ending))
}

/// Draws in the default style and writes the files. The numbers of a map are in the tables that it is drawn from.
fn write(stem: &Path, picture: &Picture) -> Result<(), FigureError> {
    let figure = picture.draw(&Style::default())?;
    let table: &[Format] = if figure.has_map() { &[] } else { &[Format::Csv] };
    figure.write(stem, &[&[Format::Svg, Format::Png], table].concat())?;
    put(stem, Picture::ENDING, |file| picture.encode(file))
}

/// Draws force over compression with the fitted law, and what is left below.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn contact_curve(stem: &Path, curve: &ContactCurve) -> Result<(), FigureError> {
    write(stem, &Picture::ContactCurve(curve.clone()))
}

/// Draws the coverage of stated intervals, a row for each quantity; bands of 66 to 70 and 93 to 97 % are shaded.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn coverage(stem: &Path, rows: &[CoverageRow]) -> Result<(), FigureError> {
    write(stem, &Picture::Coverage(rows.to_vec()))
}

/// Draws a map over wavenumber and frequency with logarithmic colours over three decades; waves that run back stand left of 0.
///
/// # Errors
/// [`FigureError`] when the map's shape does not fit its axes, or a file cannot be written.
pub fn dispersion(stem: &Path, panel: &DispersionPanel) -> Result<(), FigureError> {
    write(stem, &Picture::Dispersion(panel.clone()))
}

/// Draws the displacements of bodies over time with 95 % bands, a cross where a body was lost, and a model as a dashed
/// line, with what was measured less the model below.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn displacements(stem: &Path, bodies: &[BodyMotion]) -> Result<(), FigureError> {
    write(stem, &Picture::Displacements(bodies.to_vec()))
}

/// Draws how far points moved in the picture over time, with 95 % bands and a cross where a point was lost.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn tracks(stem: &Path, points: &[PointMotion]) -> Result<(), FigureError> {
    write(stem, &Picture::Tracks(points.to_vec()))
}

/// Draws how the camera moved in some recordings over time, with 95 % bands, where it is known.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn camera_motion(stem: &Path, recordings: &[RecordingMotion]) -> Result<(), FigureError> {
    write(stem, &Picture::CameraMotion(recordings.to_vec()))
}

/// Draws extreme cases: the error over its bound on a logarithmic axis, cases of one name in a row; a refusal stands at the
/// bound, and what failed is named by its value.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn extremes(stem: &Path, rows: &[ExtremeRow]) -> Result<(), FigureError> {
    write(stem, &Picture::Extremes(rows.to_vec()))
}

/// Draws maps of a field, each with its own colours (values of both signs from blue through white to red); points that were not measured are hatched.
///
/// # Errors
/// [`FigureError`] when a map's shape does not fit its rows and columns, or a file cannot be written.
pub fn field_map(stem: &Path, field: &FieldMap) -> Result<(), FigureError> {
    write(stem, &Picture::FieldMap(field.clone()))
}

/// Draws the leading pulses aligned at their peaks, and their half width over time, beside each other.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn front_width(stem: &Path, front: &FrontWidth) -> Result<(), FigureError> {
    write(stem, &Picture::FrontWidth(front.clone()))
}

/// Draws the group velocity against the striker velocity (the paper's Fig. 3 c).
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn group_velocity(stem: &Path, velocities: &GroupVelocities) -> Result<(), FigureError> {
    let velocities = velocities.clone();
    write(stem, &Picture::GroupVelocity(GroupVelocityFigure { velocities, against: Against::Striker }))
}

/// Draws the group velocity against the velocity of the bodies as the pulse's peak passes.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn group_velocity_by_particles(stem: &Path, velocities: &GroupVelocities) -> Result<(), FigureError> {
    let velocities = velocities.clone();
    write(stem, &Picture::GroupVelocity(GroupVelocityFigure { velocities, against: Against::Particles }))
}

/// Draws strain profiles at several times on one axis, each named by its time above its peak.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn long_chain(stem: &Path, chain: &LongChain) -> Result<(), FigureError> {
    write(stem, &Picture::LongChain(chain.clone()))
}

/// Draws a frame with its subsets.
///
/// # Errors
/// [`FigureError`] when the picture has not as many pixels as it says, or a file cannot be written.
pub fn marked_frame(stem: &Path, frame: &MarkedFrame) -> Result<(), FigureError> {
    write(stem, &Picture::MarkedFrame(frame.clone()))
}

/// Draws the peak potential energy along the chain, with and without damping, and a bar of the shares (the paper's
/// Fig. 4). When the measured gaps are less than half of the computed ones, an inset shows them enlarged.
///
/// # Errors
/// [`FigureError`] when the shares are not between 0 and 1 or add up to more than 1, or a file cannot be written.
pub fn peak_energy(stem: &Path, energy: &PeakEnergy) -> Result<(), FigureError> {
    write(stem, &Picture::PeakEnergy(energy.clone()))
}

/// Draws peak positions against peak times with the fitted line, and the residuals of the times below.
///
/// # Errors
/// [`FigureError`] when the pitch or the group velocity is not a positive number, or a file cannot be written.
pub fn peak_trace(stem: &Path, trace: &PeakTrace) -> Result<(), FigureError> {
    write(stem, &Picture::PeakTrace(trace.clone()))
}

/// Draws the right halves of leading pulses aligned at their peaks, with half widths over time in an inset (the paper's Fig. 3 b).
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn right_halves(stem: &Path, halves: &RightHalves) -> Result<(), FigureError> {
    write(stem, &Picture::RightHalves(halves.clone()))
}

/// Draws maps of normalised residuals; the colours are symmetric around zero and reach at least 3 sigma to each side.
///
/// With many samples, a cell shows one of its neighbouring samples, since their mean would scatter less than sigma says.
///
/// # Errors
/// As [`crate::strain_map`].
pub fn residual_map(stem: &Path, panels: &[ResidualMapPanel]) -> Result<(), FigureError> {
    write(stem, &Picture::ResidualMap(panels.to_vec()))
}

/// Draws strain maps beside each other with one colour scale (the paper's Fig. 2 a-c).
///
/// With many samples, a cell shows the mean of neighbouring samples, so that no map has more than 300 rows. Cells that
/// were not measured are hatched. Compression is red, tension blue.
///
/// # Errors
/// [`FigureError`] when the columns of a map do not fit its times, times do not increase, or a file
/// cannot be written.
pub fn strain_map(stem: &Path, panels: &[StrainMapPanel]) -> Result<(), FigureError> {
    write(stem, &Picture::StrainMap(panels.to_vec()))
}

/// Draws strain profiles at several times with common axes (the paper's Fig. 2 d-f).
///
/// A series keeps its look in all panels by its place in the list.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn strain_profiles(stem: &Path, panels: &[ProfilePanel]) -> Result<(), FigureError> {
    write(stem, &Picture::StrainProfiles(panels.to_vec()))
}

/// Draws the spectra of up to four gaps as curves and those of all gaps as a map, with logarithmic amplitudes over four
/// decades.
///
/// # Errors
/// [`FigureError`] when a spectrum has other numbers of frequencies than of amplitudes, or a file cannot be written.
pub fn tail_spectrum(stem: &Path, tail: &TailSpectrum) -> Result<(), FigureError> {
    write(stem, &Picture::TailSpectrum(tail.clone()))
}

/// Draws error against time, both logarithmic, with the front of methods that no other one beats; these are numbered, the fastest
/// first, and named below.
///
/// # Errors
/// [`FigureError`] when a file cannot be written.
pub fn trade_off(stem: &Path, trade_off: &TradeOff) -> Result<(), FigureError> {
    write(stem, &Picture::TradeOff(trade_off.clone()))
}
