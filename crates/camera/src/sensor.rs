//! What a sensor adds to every picture, whatever it shows: the dark level, the gain and the defects of its pixels, found from
//! recordings and taken out of others.

mod corrected;
mod correction;
mod defects;
mod neighbours;
mod statistics;

pub use corrected::Corrected;
pub use correction::SensorCorrection;
pub use defects::{Defect, DefectKind, DefectMap};
pub use statistics::PixelStatistics;
