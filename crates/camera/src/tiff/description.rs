//! What ImageJ and programs of the Open Microscopy Environment (OME) write into a TIFF's description: what its images are, how many, and the frame
//! interval with its unit.

/// Seconds in the units of time that programs write, in small letters.
const UNITS_S: [(&[&str], f64); 6] = [
    (&["s", "sec", "secs", "second", "seconds"], 1.0),
    (&["ms", "msec", "msecs", "millisecond", "milliseconds"], 1e-3),
    // Micro sign, Greek letter, and the micro sign as ImageJ writes it in plain letters.
    (
        &[
            "us",
            "usec",
            "\u{B5}s",
            "\u{B5}sec",
            "\u{3BC}s",
            "\u{3BC}sec",
            "\\u00b5s",
            "microsecond",
            "microseconds",
        ],
        1e-6,
    ),
    (&["ns", "nsec", "nanosecond", "nanoseconds"], 1e-9),
    (&["min", "mins", "minute", "minutes"], 60.0),
    (&["h", "hr", "hour", "hours"], 3600.0),
];

/// An image's description, as far as it is known.
pub(super) enum Description<'a> {
    /// Lines of `key=value`.
    ImageJ(&'a str),
    /// XML, whose element `Pixels` has the sizes.
    Ome(&'a str),
    Other,
}

impl<'a> Description<'a> {
    pub(super) fn of(text: &'a str) -> Self {
        if text.starts_with("ImageJ=") {
            Self::ImageJ(text)
        } else if text.contains("OME") && text.contains("SizeC=") {
            Self::Ome(text)
        } else {
            Self::Other
        }
    }

    /// The value of a key of ImageJ's, which stands on a line of its own.
    fn value(&self, key: &str) -> Option<&'a str> {
        let Self::ImageJ(text) = self else { return None };
        text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('=')).map(str::trim)
    }

    /// The value of an attribute of OME's, between single or double quotes.
    fn attribute(&self, name: &str) -> Option<&'a str> {
        let Self::Ome(text) = self else { return None };
        let (_, behind) = text.split_once(name)?;
        let quoted = behind.strip_prefix('=')?;
        let quote = quoted.chars().next().filter(|quote| ['"', '\''].contains(quote))?;
        quoted[1..].split(quote).next()
    }

    /// How many channels, slices in depth and times the images are of, each 1 where nothing is said.
    fn sizes(&self) -> [usize; 3] {
        [("channels", "SizeC"), ("slices", "SizeZ"), ("frames", "SizeT")].map(|(key, name)| {
            let stated = self.value(key).or_else(|| self.attribute(name));
            stated.and_then(|n| n.parse().ok()).unwrap_or(1)
        })
    }

    /// Images that are not frames one after the other, and what to do about them. A pixel has `n_samples` numbers, which OME counts as channels.
    pub(super) fn refusal(&self, n_samples: usize) -> Option<(String, String)> {
        let [n_channels, n_slices, n_times] = self.sizes();
        if n_channels > n_samples {
            let what = format!("a stack of {n_channels} channels");
            return Some((
                what,
                "save one channel by itself; in ImageJ: Image > Color > Split Channels".into(),
            ));
        }
        (n_slices > 1 && n_times > 1).then(|| {
            let what = format!("a stack of {n_slices} slices at each of {n_times} times");
            (
                what,
                "save one slice of each time; in ImageJ: Image > Hyperstacks > Reduce Dimensionality".into(),
            )
        })
    }

    /// How many images the file holds, more than one.
    pub(super) fn n_images(&self) -> Option<usize> {
        self.value("images")?.parse().ok().filter(|&n| n > 1)
    }

    /// Frames a second from the interval of frames, which is in seconds unless a unit is named; a warning in place of a rate where
    /// the unit is unknown.
    pub(super) fn rate_hz(&self) -> Result<Option<f64>, String> {
        let Some(interval) = self.value("finterval") else { return Ok(None) };
        let Some(interval) = interval.parse::<f64>().ok().filter(|&interval| interval > 0.0) else {
            return Ok(None);
        };
        let unit = self.value("tunit").filter(|unit| !unit.is_empty()).unwrap_or("s");
        let lower = unit.to_lowercase();
        let known = UNITS_S.iter().find(|(names, _)| names.contains(&lower.as_str()));
        let (_, unit_s) = known.ok_or_else(|| {
            format!(
                "the description states a frame interval of {interval} in the unknown unit `{unit}`, so that no rate is taken \
                 from it"
            )
        })?;
        let rate_hz = (interval * unit_s).recip();
        Ok((rate_hz.is_finite() && rate_hz > 0.0).then_some(rate_hz))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_is_read_in_its_unit() {
        for (lines, expected_hz) in [
            ("finterval=0.5", 2.0),
            ("finterval=0.5\ntunit=", 2.0),
            ("finterval=0.5\ntunit=sec", 2.0),
            ("finterval=0.5\ntunit=ms", 2e3),
            ("tunit=msec\nfinterval=0.5", 2e3),
            ("finterval=0.5\ntunit=us", 2e6),
            ("finterval=0.5\ntunit=\u{B5}s", 2e6),
            ("finterval=0.5\ntunit=\u{3BC}s", 2e6),
            ("finterval=0.5\ntunit=\\u00B5s", 2e6),
            ("finterval=0.5\ntunit=min", 1.0 / 30.0),
            ("finterval=25.0\r\ntunit=Milliseconds\r", 40.0),
        ] {
            let text = format!("ImageJ=1.53t\nimages=4\n{lines}\n");
            let rate_hz = Description::of(&text).rate_hz().unwrap().unwrap();
            // One product and one quotient are rounded.
            assert!((rate_hz / expected_hz - 1.0).abs() < 4.0 * f64::EPSILON, "{lines}: {rate_hz}");
        }
    }

    #[test]
    fn what_is_no_interval_gives_no_rate() {
        for lines in ["finterval=0.0", "finterval=-1", "finterval=nan", "finterval=1e-320", "fps=7", ""] {
            let text = format!("ImageJ=1.53t\n{lines}\n");
            assert_eq!(Description::of(&text).rate_hz(), Ok(None), "{lines}");
        }
        let foreign = Description::of("finterval=0.5\nimages=3");
        assert_eq!((foreign.rate_hz(), foreign.n_images()), (Ok(None), None));
        let warning = Description::of("ImageJ=1\nfinterval=0.5\ntunit=frames\n").rate_hz().unwrap_err();
        assert!(warning.contains("unknown unit `frames`"), "{warning}");
    }
}
