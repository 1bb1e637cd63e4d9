//! `chainwave contact`: the contact law of a compression curve.

use std::path::Path;

use chainwave_inference::contact_fit::{
    ContactFit, ContactFitError, Hysteresis, PARAMETERS, Profile, Zero, fit_contact,
};
use serde::Serialize;
use serde_json::json;
use toml::Table as TomlTable;

use crate::cli;
use crate::digits::with_sigma;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::{expect_apart, expect_ending, expect_folder_of, write_text};
use crate::table;
use crate::terminal::{say, tell};

/// What stands above the numbers.
const HEAD: &str = "\
# A contact law, F = a (overlap + delta_0)^p - f_0 with f_0 = a delta_0^p, in newtons and metres, and its stiffness k_0 at zero
# overlap. To use it, write law = \"fitted\" and file = \"THIS.toml\" into [contact] of an experiment or a scene.
# NAME_sigma is the standard uncertainty of NAME; a 95 % interval is NAME +- factor_95 * NAME_sigma.
";

/// The file's keys after the parameters; what was not measured is left out.
#[derive(Serialize)]
struct Details<'a> {
    factor_95: f64,
    /// What the data cannot tell apart, a sentence each.
    cannot_tell_apart: &'a [String],
    correlation: TomlTable,
    residual: Residual,
    zero: ZeroTable,
    p_profile: ProfileTable,
    branches: Branches,
}

#[derive(Serialize)]
struct Residual {
    rms_n: f64,
    largest_n: f64,
    noise_n: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    overlap_noise_m: Option<f64>,
    autocorrelation: f64,
    widening: f64,
    n_readings: usize,
    degrees_of_freedom: usize,
}

#[derive(Serialize)]
struct ZeroTable {
    rule: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    load_cell_offset_n: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    load_cell_offset_n_sigma: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    contact_start_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    contact_start_m_sigma: Option<f64>,
}

/// Exponents that the data cannot reject at 95 %, and the best law of some of them.
#[derive(Serialize)]
struct ProfileTable {
    low: f64,
    high: f64,
    open_below: bool,
    open_above: bool,
    p: Vec<f64>,
    a: Vec<f64>,
    delta_0_m: Vec<f64>,
    k_0_n_per_m: Vec<f64>,
    rms_n: Vec<f64>,
}

#[derive(Serialize)]
struct Branches {
    n_runs: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    loading_j: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    unloading_j: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lost_fraction: Option<f64>,
}

/// Fits the law, writes it, and says what it is.
pub(crate) fn contact(arguments: &cli::Contact) -> Result<Outcome, Error> {
    expect_apart(&[&arguments.curve], &[("the law", arguments.out.clone())])?;
    expect_ending(&arguments.out, "toml")?;
    expect_folder_of(&arguments.out)?;
    let table = table::read(&arguments.curve)?;
    let (overlap_m, force_n) = (table.full_numbers("overlap_m")?, table.full_numbers("force_n")?);
    let fit = fit_contact(&overlap_m, &force_n, arguments.zero.rule())
        .map_err(|refused| refusal(&arguments.curve, &refused))?;
    write_text(&arguments.out, &text_of(&fit)?)?;
    print(&arguments.out, &fit);
    Ok(Outcome::default())
}

/// Says the law with its uncertainties, and what the curve leaves open.
fn print(out: &Path, fit: &ContactFit) {
    say!("force = a (overlap + delta_0)^p - f_0, fitted to {} readings:", fit.residual.n_readings);
    for (name, estimate) in PARAMETERS.iter().zip(&fit.estimates) {
        say!("  {name} = {}", with_sigma(*estimate));
    }
    say!("  residual {:.2e} N (rms), {:.2e} N at most", fit.residual.rms_n, fit.residual.largest_n);
    say!("what the curve cannot tell apart:");
    for sentence in &fit.ambiguities {
        say!("  {sentence}");
    }
    say!("wrote {}", out.display());
    for (name, estimate) in PARAMETERS.into_iter().zip(&fit.estimates) {
        tell(name, json!({ "value": estimate.value, "sigma": estimate.sigma }));
    }
    tell("cannot_tell_apart", json!(fit.ambiguities));
}

/// The refusal with its file, and the line where there is one.
fn refusal(path: &Path, refused: &ContactFitError) -> Error {
    let line = refused.reading().map_or(String::new(), |reading| format!("line {}: ", reading + 2));
    Error::configuration(path, format!("{line}{refused}"))
}

fn text_of(fit: &ContactFit) -> Result<String, Error> {
    let mut text = format!("{HEAD}law = \"power\"\n");
    for (name, estimate) in PARAMETERS.iter().zip(&fit.estimates) {
        text.push_str(&format!("{name} = {:?}\n{name}_sigma = {:?}\n", estimate.value, estimate.sigma));
    }
    let details = toml::to_string(&Details::of(fit)).map_err(|wrong| Error::Argument(wrong.to_string()))?;
    Ok(text + &details)
}

impl<'a> Details<'a> {
    fn of(fit: &'a ContactFit) -> Self {
        let residual = fit.residual;
        Self {
            factor_95: fit.factor_95,
            cannot_tell_apart: &fit.ambiguities,
            correlation: correlation(fit),
            residual: Residual {
                rms_n: residual.rms_n,
                largest_n: residual.largest_n,
                noise_n: residual.noise_n,
                overlap_noise_m: residual.overlap_noise_m,
                autocorrelation: residual.autocorrelation,
                widening: residual.widening,
                n_readings: residual.n_readings,
                degrees_of_freedom: residual.degrees_of_freedom,
            },
            zero: ZeroTable::of(fit),
            p_profile: ProfileTable::of(&fit.profile),
            branches: Branches::of(fit.n_runs, fit.hysteresis),
        }
    }
}

/// Each pair of parameters once, as `[correlation.a] p = ...`.
fn correlation(fit: &ContactFit) -> TomlTable {
    let row = |i: usize| {
        let others = i + 1..PARAMETERS.len();
        let pairs = others.map(|j| (PARAMETERS[j].to_owned(), fit.correlation[i][j].into()));
        TomlTable::from_iter(pairs)
    };
    (0..PARAMETERS.len() - 1).map(|i| (PARAMETERS[i].to_owned(), row(i).into())).collect()
}

impl ZeroTable {
    fn of(fit: &ContactFit) -> Self {
        let (offset, start) = (fit.load_cell_offset_n, fit.contact_start_m);
        Self {
            rule: match fit.zero {
                Zero::Contact => "contact",
                Zero::LoadCell => "load-cell",
                Zero::Stated | Zero::Auto => "stated",
            },
            load_cell_offset_n: offset.map(|offset| offset.value),
            load_cell_offset_n_sigma: offset.map(|offset| offset.sigma),
            contact_start_m: start.map(|start| start.value),
            contact_start_m_sigma: start.map(|start| start.sigma),
        }
    }
}

impl ProfileTable {
    fn of(profile: &Profile) -> Self {
        let laws = || profile.laws.iter().map(|at| at.law);
        Self {
            low: profile.low,
            high: profile.high,
            open_below: profile.open_below,
            open_above: profile.open_above,
            p: laws().map(|law| law.p).collect(),
            a: laws().map(|law| law.a).collect(),
            delta_0_m: laws().map(|law| law.delta_0_m).collect(),
            k_0_n_per_m: laws().map(|law| law.k_0_n_per_m()).collect(),
            rms_n: profile.laws.iter().map(|at| at.rms_n).collect(),
        }
    }
}

impl Branches {
    fn of(n_runs: usize, hysteresis: Option<Hysteresis>) -> Self {
        Self {
            n_runs,
            loading_j: hysteresis.map(|loss| loss.loading_j),
            unloading_j: hysteresis.map(|loss| loss.unloading_j),
            lost_fraction: hysteresis.map(|loss| loss.lost_fraction),
        }
    }
}
