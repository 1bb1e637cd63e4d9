//! Every figure as one value, which is kept beside its files and drawn again from there.

use std::fs::File;
use std::io::{BufReader, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::figure::{Draw, Figure};
use crate::{
    BodyMotion, ContactCurve, CoverageCount, CoverageRow, DispersionPanel, ExtremeRow, FieldMap, FigureError,
    FrontWidth, GroupVelocityFigure, LongChain, MarkedFrame, PeakCurve, PeakEnergy, PeakTrace, PointMotion,
    ProfilePanel, RecordingMotion, ResidualMapPanel, RightHalves, StrainMapPanel, Style, TailSpectrum,
    TradeOff,
};

/// What a figure shows, whichever it is.
///
/// A figure's function keeps it beside the files as `STEM.cbor` (RFC 8949), exact to the last bit and with what was not measured, so that
/// the figure is drawn again in another style without a computation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "figure", content = "values", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Picture {
    /// See [`ContactCurve`].
    ContactCurve(ContactCurve),
    /// See [`CoverageRow`].
    Coverage(Vec<CoverageRow>),
    /// See [`CoverageCount`].
    CoverageCounts(Vec<CoverageCount>),
    /// See [`DispersionPanel`].
    Dispersion(DispersionPanel),
    /// See [`BodyMotion`].
    Displacements(Vec<BodyMotion>),
    /// See [`PointMotion`].
    Tracks(Vec<PointMotion>),
    /// See [`RecordingMotion`].
    CameraMotion(Vec<RecordingMotion>),
    /// See [`ExtremeRow`].
    Extremes(Vec<ExtremeRow>),
    /// See [`FieldMap`].
    FieldMap(FieldMap),
    /// See [`FrontWidth`].
    FrontWidth(FrontWidth),
    /// See [`RightHalves`].
    RightHalves(RightHalves),
    /// See [`GroupVelocityFigure`].
    GroupVelocity(GroupVelocityFigure),
    /// See [`LongChain`].
    LongChain(LongChain),
    /// See [`MarkedFrame`].
    MarkedFrame(MarkedFrame),
    /// See [`PeakEnergy`].
    PeakEnergy(PeakEnergy),
    /// See [`PeakTrace`].
    PeakTrace(PeakTrace),
    /// See [`PeakCurve`].
    PeakCurve(PeakCurve),
    /// See [`ResidualMapPanel`].
    ResidualMap(Vec<ResidualMapPanel>),
    /// See [`StrainMapPanel`].
    StrainMap(Vec<StrainMapPanel>),
    /// See [`ProfilePanel`].
    StrainProfiles(Vec<ProfilePanel>),
    /// See [`TailSpectrum`].
    TailSpectrum(TailSpectrum),
    /// See [`TradeOff`].
    TradeOff(TradeOff),
}

impl Picture {
    /// The ending of the file that it is kept in.
    pub const ENDING: &'static str = "cbor";

    /// Reads a picture that was kept.
    ///
    /// # Errors
    /// [`FigureError::Read`] when the file cannot be read or holds none.
    pub fn read(path: &Path) -> Result<Self, FigureError> {
        let failed = |reason: String| FigureError::Read { path: path.to_owned(), reason };
        let file = File::open(path).map_err(|why| failed(why.to_string()))?;
        ciborium::from_reader(BufReader::new(file)).map_err(|why| failed(why.to_string()))
    }

    /// Writes what [`Picture::read`] reads.
    pub(crate) fn encode(&self, file: impl Write) -> std::io::Result<()> {
        ciborium::into_writer(self, file).map_err(std::io::Error::other)
    }
}

impl Draw for Picture {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        match self {
            Self::ContactCurve(drawn) => drawn.draw(style),
            Self::Coverage(drawn) => drawn.draw(style),
            Self::CoverageCounts(drawn) => drawn.draw(style),
            Self::Dispersion(drawn) => drawn.draw(style),
            Self::Displacements(drawn) => drawn.draw(style),
            Self::Tracks(drawn) => drawn.draw(style),
            Self::CameraMotion(drawn) => drawn.draw(style),
            Self::Extremes(drawn) => drawn.draw(style),
            Self::FieldMap(drawn) => drawn.draw(style),
            Self::FrontWidth(drawn) => drawn.draw(style),
            Self::RightHalves(drawn) => drawn.draw(style),
            Self::GroupVelocity(drawn) => drawn.draw(style),
            Self::LongChain(drawn) => drawn.draw(style),
            Self::MarkedFrame(drawn) => drawn.draw(style),
            Self::PeakEnergy(drawn) => drawn.draw(style),
            Self::PeakTrace(drawn) => drawn.draw(style),
            Self::PeakCurve(drawn) => drawn.draw(style),
            Self::ResidualMap(drawn) => drawn.draw(style),
            Self::StrainMap(drawn) => drawn.draw(style),
            Self::StrainProfiles(drawn) => drawn.draw(style),
            Self::TailSpectrum(drawn) => drawn.draw(style),
            Self::TradeOff(drawn) => drawn.draw(style),
        }
    }
}
