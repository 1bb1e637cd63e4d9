//! A subset as its reference has it, as a frame shows it, and the difference of both.

use chainwave_measurement::{ReadError, Recording, Region};

/// What is shown of a subset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    /// The mean of the frames at rest.
    Reference,
    /// The frame around the place found.
    Found,
    /// The frame less the reference, each with its mean taken off and in units of its standard deviation.
    Residual,
}

impl Part {
    /// By its name in an address.
    pub(crate) fn named(name: &str) -> Option<Self> {
        match name {
            "reference" => Some(Self::Reference),
            "found" => Some(Self::Found),
            "residual" => Some(Self::Residual),
            _ => None,
        }
    }
}

/// A subset in two places of a recording.
pub(crate) struct Matched<'a> {
    pub(crate) recording: &'a dyn Recording,
    /// Columns and rows on each side of its centre.
    pub(crate) half_px: [usize; 2],
    /// The frames at rest, and its centre there.
    pub(crate) rest: std::ops::Range<usize>,
    pub(crate) rest_px: [f64; 2],
    /// The frame, and its centre there.
    pub(crate) frame: usize,
    pub(crate) found_px: [f64; 2],
}

/// Standard deviations that are white above the mean, and black below.
const SHOWN: f64 = 2.5;
/// The same of a residual, which is smaller.
const SHOWN_RESIDUAL: f64 = 1.0;

impl Matched<'_> {
    /// Columns and rows of the pictures.
    pub(crate) fn size(&self) -> [usize; 2] {
        self.half_px.map(|half| 2 * half + 1)
    }

    /// Grey values of one picture, row by row from the top. Pixels outside of the frame count as its mean; the subset is neither turned nor
    /// stretched.
    pub(crate) fn greys(&self, part: Part) -> Result<Vec<u8>, ReadError> {
        let reference = || {
            let mut sum = vec![0.0; self.size()[0] * self.size()[1]];
            for frame in self.rest.clone() {
                let shown = self.shown(frame, self.rest_px)?;
                sum.iter_mut().zip(normalised(shown)).for_each(|(sum, value)| *sum += value);
            }
            Ok::<_, ReadError>(normalised(sum.into_iter().map(Some).collect()))
        };
        let found = || Ok::<_, ReadError>(normalised(self.shown(self.frame, self.found_px)?));
        let (values, range) = match part {
            Part::Reference => (reference()?, SHOWN),
            Part::Found => (found()?, SHOWN),
            Part::Residual => {
                let less = |(found, reference): (f64, f64)| found - reference;
                (found()?.into_iter().zip(reference()?).map(less).collect(), SHOWN_RESIDUAL)
            }
        };
        let grey = |value: f64| (127.5 * (1.0 + value / range)).round() as u8; // casts saturate
        Ok(values.into_iter().map(grey).collect())
    }

    /// Counts around a place of a frame, between pixels by the four around; none outside of the frame.
    fn shown(&self, frame: usize, [x, y]: [f64; 2]) -> Result<Vec<Option<f64>>, ReadError> {
        let info = self.recording.info();
        let [half_x, half_y] = self.half_px.map(|half| half as i64);
        let (left, top) = (x.floor() as i64, y.floor() as i64);
        let region = Region::clipped(
            left - half_x,
            top - half_y,
            left + half_x + 2,
            top + half_y + 2,
            info.width_px,
            info.height_px,
        );
        let Some(region) = region else { return Ok(vec![None; self.size()[0] * self.size()[1]]) };
        let mut counts = vec![0.0; region.n_pixels()];
        self.recording.read_region(frame, region, &mut counts)?;
        let count = |column: i64, row: i64| {
            let column = usize::try_from(column).ok()?.checked_sub(region.x)?;
            let row = usize::try_from(row).ok()?.checked_sub(region.y)?;
            (column < region.width && row < region.height)
                .then(|| f64::from(counts[row * region.width + column]))
        };
        let mixed = |one: f64, next: f64, share: f64| (1.0 - share) * one + share * next;
        let along_row =
            |column: i64, row: i64| Some(mixed(count(column, row)?, count(column + 1, row)?, x - x.floor()));
        let between = |column: i64, row: i64| {
            Some(mixed(along_row(column, row)?, along_row(column, row + 1)?, y - y.floor()))
        };
        let rows = -half_y..=half_y;
        Ok(rows
            .flat_map(|row| (-half_x..=half_x).map(move |column| (left + column, top + row)))
            .map(|(column, row)| between(column, row))
            .collect())
    }
}

/// Values less their mean, in units of their standard deviation; 0 where there are none.
fn normalised(values: Vec<Option<f64>>) -> Vec<f64> {
    let known: Vec<f64> = values.iter().flatten().copied().collect();
    let n = known.len().max(1) as f64;
    let mean = known.iter().sum::<f64>() / n;
    let sigma = (known.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt();
    let scale = if sigma > 0.0 { sigma.recip() } else { 0.0 };
    values.into_iter().map(|value| value.map_or(0.0, |value| scale * (value - mean))).collect()
}
