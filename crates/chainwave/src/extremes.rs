//! `chainwave extremes`: cases at the ends of what the program takes, each with what is expected of it and what came out.
//!
//! An area is one file that lists its [`Family`]s: a case, the values of its parameter, and a function that measures an error
//! against a truth of its own. A case passes when that error is within its bound, or, where the family says so, when it was
//! refused with a reason.

mod mechanics;
mod ring;

use std::path::Path;

use chainwave_figures::{ExtremeRow, extremes as draw};
use chainwave_mechanics::MechanicsError;

use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::{make_folder, remove_unfinished};
use crate::parallel::threads;
use crate::table::{self, column};

/// A case over the values of its parameter.
struct Family {
    case: &'static str,
    parameter: &'static str,
    values: Vec<f64>,
    /// What is measured and held against the bound.
    quantity: &'static str,
    bound: f64,
    /// Whether a refusal with a reason is right too.
    may_refuse: bool,
    measure: Measure,
}

/// The error at a value of the parameter, or why there is none.
type Measure = Box<dyn Fn(f64) -> Result<f64, String> + Send + Sync>;

/// What came out of one case.
struct ExtremeFinding {
    area: &'static str,
    case: &'static str,
    parameter: &'static str,
    value: f64,
    expected: String,
    observed: String,
    passed: bool,
    /// The measured error, where there is one, and its bound.
    error: Option<f64>,
    bound: f64,
}

/// Runs every case, tabulates and draws them.
pub(crate) fn extremes(arguments: &cli::Extremes) -> Result<Outcome, Error> {
    make_folder(&arguments.out)?;
    remove_unfinished(&arguments.out)?;
    let areas = [("mechanics", mechanics::families()), ("ring", ring::families())];
    let cases: Vec<(&'static str, &Family, f64)> = areas
        .iter()
        .flat_map(|(area, families)| families.iter().map(move |family| (*area, family)))
        .flat_map(|(area, family)| family.values.iter().map(move |value| (area, family, *value)))
        .collect();
    let findings = chainwave_measurement::map_in_parallel(cases.len(), threads(arguments.jobs), |i| {
        let (area, family, value) = &cases[i];
        family.try_at(area, *value)
    });
    write(&arguments.out.join("extremes.parquet"), &findings)?;
    let rows: Vec<ExtremeRow> = findings.iter().map(ExtremeFinding::row).collect();
    draw(&arguments.out.join("extremes"), &rows)?;
    let mut outcome = Outcome::default();
    for finding in findings.iter().filter(|finding| !finding.passed) {
        outcome.fail(finding.summary());
    }
    Ok(outcome)
}

impl Family {
    fn new(
        case: &'static str,
        parameter: &'static str,
        values: &[f64],
        quantity: &'static str,
        bound: f64,
        measure: impl Fn(f64) -> Result<f64, String> + Send + Sync + 'static,
    ) -> Self {
        let (values, may_refuse) = (values.to_vec(), false);
        Self { case, parameter, values, quantity, bound, may_refuse, measure: Box::new(measure) }
    }

    /// The same family, where a refusal with a reason is right too.
    fn or_refused(self) -> Self {
        Self { may_refuse: true, ..self }
    }

    fn try_at(&self, area: &'static str, value: f64) -> ExtremeFinding {
        let measured = (self.measure)(value);
        let refusal = if self.may_refuse { ", or refused with a reason" } else { "" };
        ExtremeFinding {
            area,
            case: self.case,
            parameter: self.parameter,
            value,
            expected: format!("{} <= {:e}{refusal}", self.quantity, self.bound),
            passed: match &measured {
                Ok(error) => *error <= self.bound,
                Err(_) => self.may_refuse,
            },
            observed: match &measured {
                Ok(error) => format!("{error:.3e}"),
                Err(reason) => format!("refused: {reason}"),
            },
            error: measured.ok(),
            bound: self.bound,
        }
    }
}

/// Powers of ten, each the double nearest to it.
fn decades(from: i32, to: i32) -> Vec<f64> {
    (from..=to).map(|exponent| format!("1e{exponent}").parse().unwrap_or(f64::NAN)).collect()
}

#[expect(clippy::needless_pass_by_value, reason = "map_err hands the error over")]
fn text(error: MechanicsError) -> String {
    error.to_string()
}

impl ExtremeFinding {
    fn row(&self) -> ExtremeRow {
        ExtremeRow {
            name: format!("{}, {} = {:e}", self.case, self.parameter, self.value),
            share_of_bound: self.error.map(|error| error / self.bound),
            passed: self.passed,
        }
    }

    fn summary(&self) -> String {
        let Self { area, case, parameter, value, expected, observed, .. } = self;
        format!("{area}, {case}, {parameter} = {value:e}: expected {expected}, found {observed}")
    }
}

fn write(path: &Path, findings: &[ExtremeFinding]) -> Result<(), Error> {
    let texts = |text: fn(&ExtremeFinding) -> &str| findings.iter().map(text).collect::<Vec<_>>();
    table::write(
        path,
        vec![
            column("area", texts(|finding| finding.area)),
            column("case", texts(|finding| finding.case)),
            column("parameter", texts(|finding| finding.parameter)),
            column("value", findings.iter().map(|finding| finding.value).collect::<Vec<_>>()),
            column("expected", texts(|finding| &finding.expected)),
            column("observed", texts(|finding| &finding.observed)),
            column("passed", findings.iter().map(|finding| finding.passed).collect::<Vec<_>>()),
            column("error", findings.iter().map(|finding| finding.error).collect::<Vec<_>>()),
            column("bound", findings.iter().map(|finding| finding.bound).collect::<Vec<_>>()),
        ],
    )
}
