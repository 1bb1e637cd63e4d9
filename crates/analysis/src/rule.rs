//! Rules of decision: what is asked, by which test and at which level a simpler model is left, and how often that is wrong.

use std::fmt;

use chainwave_measurement::Estimate;

/// Level of every test: the probability of leaving the simpler model although it holds.
pub const SIGNIFICANCE_LEVEL: f64 = 0.01;

/// By which rule one model is chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// What is to be chosen.
    pub question: &'static str,
    /// Which model is kept unless what, with the test's name and level.
    pub text: String,
    /// Probability with which the test leaves a simpler model that holds; `None` where nothing is tested.
    pub level: Option<f64>,
    /// How often it did in synthetic experiments.
    pub rates: Vec<FalseRate>,
}

impl Rule {
    /// Whether the simpler model is left at a p-value.
    pub fn rejects(&self, p_value: f64) -> bool {
        self.level.is_some_and(|level| p_value < level)
    }

    /// How often it is wrong, in words; empty where nothing was measured.
    pub fn rates_in_words(&self) -> String {
        self.rates.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
    }
}

/// How often a test left a simpler model that held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FalseRate {
    /// What was told.
    pub what: &'static str,
    /// At which level.
    pub level: f64,
    /// In how many cases.
    pub told: u32,
    /// Of how many.
    pub of: u32,
    /// What the cases are.
    pub cases: &'static str,
}

impl FalseRate {
    /// Counts the p-values below a level.
    pub fn count(what: &'static str, cases: &'static str, level: f64, p_values: &[f64]) -> Self {
        let told = p_values.iter().filter(|p_value| **p_value < level).count();
        Self { what, level, told: told as u32, of: p_values.len() as u32, cases }
    }

    /// Counts those of a column of a table of p-values: lines of `#` before names and rows, separated by commas. `None` without the
    /// column, or where an entry is no number.
    pub fn count_column(
        what: &'static str,
        cases: &'static str,
        level: f64,
        table: &str,
        column: &str,
    ) -> Option<Self> {
        let mut lines = table.lines().filter(|line| !line.starts_with('#'));
        let place = lines.next()?.split(',').position(|name| name == column)?;
        let p_values = lines.map(|line| line.split(',').nth(place)?.parse().ok());
        Some(Self::count(what, cases, level, &p_values.collect::<Option<Vec<f64>>>()?))
    }

    /// The share, with its binomial standard error (of none or all: that of one more or less).
    pub fn share(&self) -> Estimate {
        let n = f64::from(self.of.max(1));
        let share = f64::from(self.told) / n;
        let within = share.clamp(n.recip().min(0.5), 1.0 - n.recip().min(0.5));
        Estimate::new(share, (within * (1.0 - within) / n).sqrt())
    }

    /// Whether another count of the same test agrees within so many standard errors of the difference, both sides, for one share of
    /// both (score test).
    pub fn agrees(&self, other: &Self, deviations: f64) -> bool {
        let [n, m] = [self, other].map(|one| f64::from(one.of.max(1)));
        let pooled =
            (f64::from(self.told + other.told) / (n + m)).clamp((n + m).recip(), 1.0 - (n + m).recip());
        let sigma = (pooled * (1.0 - pooled) * (n.recip() + m.recip())).sqrt();
        // Counts are whole: half a count of the smaller sample is no difference.
        let rounding = 0.5 / n.min(m);
        (self.share().value - other.share().value).abs() <= deviations * sigma + rounding
    }
}

impl fmt::Display for FalseRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let share = self.share().scaled(100.0);
        write!(
            f,
            "{} falsely told in {:.1} +- {:.1} % of {} {} at a level of {} %",
            self.what,
            share.value,
            share.sigma,
            self.of,
            self.cases,
            100.0 * self.level
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_says_how_well_it_is_known() {
        let rate = FalseRate { what: "c_d", level: 0.01, told: 12, of: 1000, cases: "synthetic experiments" };
        let words = "c_d falsely told in 1.2 +- 0.3 % of 1000 synthetic experiments at a level of 1 %";
        assert_eq!(rate.to_string(), words);
        assert!(FalseRate { told: 0, ..rate }.share().sigma > 0.0);
    }

    #[test]
    fn counts_agree_within_chance() {
        let rate = FalseRate { what: "", level: 0.1, told: 100, of: 1000, cases: "" };
        // 10 +- 3 of 100, and the table's own 1 %: 10 +- 3.1.
        for (told, agrees) in [(0, false), (1, true), (10, true), (19, true), (21, false)] {
            assert_eq!(FalseRate { told, of: 100, ..rate }.agrees(&rate, 3.0), agrees, "{told}");
        }
    }

    #[test]
    fn a_rule_without_a_test_rejects_nothing() {
        let rule = Rule { question: "", text: String::new(), level: None, rates: Vec::new() };
        assert!(!rule.rejects(0.0));
        assert!(Rule { level: Some(SIGNIFICANCE_LEVEL), ..rule }.rejects(0.009));
    }
}
