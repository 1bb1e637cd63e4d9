//! What a request asks for: the parts of its path and the parameters of its query, decoded and checked.

use std::str::FromStr;

use crate::refusal::Refusal;

/// Longer addresses are refused: the longest that the page asks for has some 200 bytes.
const MOST_URL_BYTES: usize = 2048;

/// A request's address, decoded.
#[derive(Debug)]
pub(crate) struct Asked {
    /// The path as it was sent, cut to a length that can be shown.
    pub(crate) path: String,
    /// What stands between its slashes.
    pub(crate) parts: Vec<String>,
    parameters: Vec<(String, String)>,
}

impl Asked {
    /// Takes an address such as `/api/frame/3?x=10` apart.
    pub(crate) fn parse(url: &str) -> Result<Self, Refusal> {
        let (path, query) = url.split_once('?').unwrap_or((url, ""));
        let shown: String = path.chars().take(100).collect();
        let refused = |found: String| Refusal::new(400, shown.clone(), "an address of this page", found);
        if url.len() > MOST_URL_BYTES {
            return Err(refused(format!("{} bytes", url.len())));
        }
        let decode = |text: &str| decoded(text).ok_or_else(|| refused("a broken % sequence".into()));
        let parts = path.split('/').filter(|part| !part.is_empty()).map(decode).collect::<Result<_, _>>()?;
        let mut parameters = Vec::new();
        for pair in query.split('&').filter(|pair| !pair.is_empty()) {
            let (name, value) = pair.split_once('=').unwrap_or((pair, ""));
            parameters.push((decode(name)?, decode(value)?));
        }
        Ok(Self { path: shown, parts, parameters })
    }

    /// A parameter's text; the first where it stands twice.
    pub(crate) fn text(&self, name: &str) -> Option<&str> {
        self.parameters.iter().find(|(found, _)| found == name).map(|(_, value)| value.as_str())
    }

    /// A parameter's value, or the default where it is left out.
    pub(crate) fn value<T: FromStr>(&self, name: &str, expected: &str, default: T) -> Result<T, Refusal> {
        match self.text(name) {
            Some(text) => text.parse().map_err(|_| self.refuse(name, expected, text)),
            None => Ok(default),
        }
    }

    /// A finite number, or the default where it is left out.
    pub(crate) fn number(&self, name: &str, default: f64) -> Result<f64, Refusal> {
        let value = self.value(name, "a finite number", default)?;
        match value.is_finite() {
            true => Ok(value),
            false => Err(self.refuse(name, "a finite number", &value.to_string())),
        }
    }

    /// A parameter that cannot be answered to.
    pub(crate) fn refuse(&self, name: &str, expected: &str, found: &str) -> Refusal {
        let found: String = found.chars().take(100).collect();
        Refusal::new(400, self.path.clone(), format!("{name}: {expected}"), found)
    }

    /// An address at which nothing is.
    pub(crate) fn nothing_here(&self) -> Refusal {
        let expected = "/, /api/recordings, /api/recording, /api/frame/K, /api/levels/K, /api/markers, /api/sigma/K, /api/tracks/K, \
                        /api/points, /api/experiment, /api/wave, /api/review, /api/subset/K or /api/corrections";
        Refusal::new(404, self.path.clone(), expected, self.path.clone())
    }
}

/// A text whose `%XX` stand for bytes; `None` where they stand for none, or the bytes are no UTF-8.
fn decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        rest = after;
        bytes.push(match first {
            b'%' => {
                let (digits, after) = rest.split_first_chunk::<2>()?;
                rest = after;
                let digit = |digit: u8| char::from(digit).to_digit(16);
                u8::try_from(16 * digit(digits[0])? + digit(digits[1])?).ok()?
            }
            b'+' => b' ',
            byte => byte,
        });
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_taken_apart() {
        let asked = Asked::parse("/api//frame/3?x=10&low=-1.5&name=a%20b+c&x=11&flag").unwrap();
        assert_eq!(asked.parts, ["api", "frame", "3"]);
        assert_eq!((asked.text("x"), asked.text("name")), (Some("10"), Some("a b c")));
        assert_eq!((asked.text("flag"), asked.text("y")), (Some(""), None));
        assert_eq!(asked.value("x", "a whole number", 0_usize).unwrap(), 10);
        assert_eq!(asked.number("low", 0.0).unwrap().to_bits(), (-1.5_f64).to_bits());
    }

    #[test]
    fn what_cannot_be_meant_is_refused() {
        for url in ["/%", "/%4", "/%zz", "/%ff", "/a?b=%c3%28", &format!("/?x={}", "9".repeat(3000))] {
            assert_eq!(Asked::parse(url).unwrap_err().status, 400, "{url}");
        }
        let asked = Asked::parse("/?x=-1&low=inf&high=NaN").unwrap();
        assert!(asked.value("x", "a whole number", 0_usize).is_err());
        assert!(asked.number("low", 0.0).is_err() && asked.number("high", 0.0).is_err());
    }
}
