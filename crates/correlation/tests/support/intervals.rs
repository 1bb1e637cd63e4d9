//! What errors say of the intervals that are stated of them.

#![expect(unreachable_pub, reason = "test binaries share it")]

/// Errors along y beside their sigmas.
#[derive(Debug)]
pub struct Told {
    /// Share of the errors within 1.96 sigma.
    pub inside: f64,
    /// Median of the sigmas.
    pub sigma_px: f64,
    /// Root mean square of the errors.
    pub rms_px: f64,
}

impl Told {
    /// Of an error and its sigma each.
    pub fn of(mut errors: Vec<[f64; 2]>) -> Self {
        let n = errors.len() as f64;
        let inside = errors.iter().filter(|[error, sigma]| error.abs() < 1.96 * sigma).count() as f64 / n;
        let rms_px = (errors.iter().map(|[error, _]| error * error).sum::<f64>() / n).sqrt();
        errors.sort_by(|a, b| a[1].total_cmp(&b[1]));
        Self { inside, sigma_px: errors[errors.len() / 2][1], rms_px }
    }

    /// The claim is 93 to 97 %, beyond which two standard errors of so many independent readings are left.
    pub fn assert_both_sides(&self, name: &str, n_independent: f64) {
        let Self { inside, sigma_px, rms_px } = self;
        println!("{name}: {:.1} % of 95, {:.2}/{:.2} mpx", 100.0 * inside, 1e3 * sigma_px, 1e3 * rms_px);
        let standard_error = (0.95 * 0.05 / n_independent).sqrt();
        assert!((inside - 0.95).abs() < 0.02 + 2.0 * standard_error, "{name}: {inside}");
    }
}
