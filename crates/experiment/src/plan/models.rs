//! What of the models and of the evaluation is needed for the results that are asked for; the rest is not made, and is said not to have been
//! asked for.

use super::aim::Aim;
use super::precision::{PlannedResult, Precision};
use super::rehearsal::Rehearsal;
use crate::evaluation::decisions::Decision;
use crate::setup::Setup;

/// Numbers of replicas that are tried where fewer than stated may do.
const REPLICAS: [usize; 2] = [50, 100];
/// Of the scatter of a sigma that replicas tell, so many may be added to what is foreseen before it exceeds what is asked: one in 700 does.
const SCATTERS: f64 = 3.0;

fn is_damping(aim: &Aim) -> bool {
    matches!(aim.result, PlannedResult::ChainDamping | PlannedResult::StrikerDamping)
}

/// Leaves out the fits of the chain model where neither a damping is asked for nor triggers of views that share no body, and the pulses one by
/// one, of which no result is asked.
pub(super) fn choose_models(setup: &mut Setup, aims: &[Aim], rehearsal: &Rehearsal) -> Vec<Decision> {
    let apart = rehearsal.views_apart();
    let asks = aims.iter().any(is_damping);
    let names: Vec<&str> = aims.iter().map(|aim| aim.result.symbol()).collect();
    let analysis = &mut setup.experiment.analysis;
    analysis.fits = asks || (analysis.fits && !apart.is_empty());
    analysis.pulses = false;
    let (choice, evidence) = match (asks, analysis.fits) {
        (true, _) => ("those of c_d and c_s", format!("asked for: {}", names.join(", "))),
        (false, true) => {
            let views: Vec<String> = apart.iter().map(u32::to_string).collect();
            ("those of c_d and c_s", format!("no other view shows a body of view {}", views.join(", ")))
        }
        (false, false) => ("none", format!("{} follow from the motion alone", names.join(", "))),
    };
    vec![
        Decision {
            question: "models that are fitted",
            choice: choice.into(),
            rule: "those of c_d and c_s where one of these is asked for, or where views share no body, of which the model tells triggers and \
                   drives better than the onset does; else none"
                .into(),
            evidence,
        },
        Decision {
            question: "pulses one by one",
            choice: "not followed".into(),
            rule: "followed where nothing was asked for by its accuracy".into(),
            evidence: format!("asked for: {}", names.join(", ")),
        },
    ]
}

/// The fewest replicas by which sigmas still come out as they are asked.
pub(super) fn choose_replicas(setup: &mut Setup, aims: &[Aim], expected: &Precision) -> Decision {
    let analysis = &mut setup.experiment.analysis;
    let stated = analysis.n_replicas;
    let by_replicas = aims.iter().filter(|aim| !is_damping(aim) && aim.result != PlannedResult::Displacement);
    let is_enough = |n: usize| {
        by_replicas.clone().all(|aim| {
            let found = expected.of(aim.result).as_ref();
            let more = 1.0 + SCATTERS / (2.0 * n as f64).sqrt();
            found.is_ok_and(|found| more * found.sigma <= aim.sigma(found.value))
        })
    };
    let fewest = REPLICAS.into_iter().filter(|n| *n < stated && !analysis.fits).find(|n| is_enough(*n));
    let evidence = match (fewest, analysis.fits) {
        (Some(n), _) => format!(
            "foreseen sigmas stay within what was asked with {SCATTERS} times the {:.0} % to which {n} tell them",
            { 100.0 / (2.0 * n as f64).sqrt() }
        ),
        (None, true) => "the fit to the peak energies needs their covariance".into(),
        (None, false) => "fewer tell a sigma too badly for what was asked".into(),
    };
    analysis.n_replicas = fewest.unwrap_or(stated);
    Decision {
        question: "replicas behind each uncertainty",
        choice: format!("{} of {stated}", analysis.n_replicas),
        rule: format!(
            "the fewest of {REPLICAS:?} that leave what is foreseen within what was asked, by {SCATTERS} times their own scatter; as stated \
                       where a model is fitted"
        ),
        evidence,
    }
}
