//! What the evaluation takes to be so where neither the experiment nor its recordings tell it.

use chainwave_inference::{
    ODDS_OF_A_CAUSE, ODDS_OF_SCATTER, SIGMAS_OF_A_CAUSE, UNSTATED_MASS_SCATTER, UNSTATED_STIFFNESS_SCATTER,
};
use chainwave_stitching::{Assumption, Stitched};

use crate::chain::chain_model::STARTING_SHARES;
use crate::configuration::Experiment;
use crate::geometry::scale::USUAL_STAGE_SIGMA_M;

/// How well the scale of drives is known that no onset tells.
pub(crate) const DRIVE_SCALE_SIGMA: f64 = 0.5;

/// What is assumed of the pictures.
pub(crate) fn assumed_of_pictures(experiment: &Experiment) -> Option<Assumption> {
    experiment.camera.stage_sigma_m.is_none().then(|| Assumption {
        of: "assumed: how well positions of the stage are known",
        value: USUAL_STAGE_SIGMA_M,
        in_words: format!("to {} mm (camera.stage_sigma_m)", 1e3 * USUAL_STAGE_SIGMA_M),
        decides: "what the stage's steps tell of the scale and of the pictures' geometry",
        reason: "a scale that is read to some hundredths of a millimetre",
    })
}

/// What fits assume.
pub(crate) fn assumed_by_fits(
    experiment: &Experiment,
    stitched: &Stitched,
) -> impl Iterator<Item = Assumption> {
    let is_untold = experiment.striker.is_some() && stitched.drive_scale_sigma.is_none();
    let masses = experiment.chain.mass_scatter.is_none().then(scatter_of_masses);
    let stiffness = experiment.contact.stiffness_scatter.is_none().then(scatter_of_stiffness);
    let scale = is_untold.then(scale_of_drives);
    [Some(start()), scale, masses, stiffness, Some(causes()), Some(bodies_hardly_alike())]
        .into_iter()
        .flatten()
}

fn start() -> Assumption {
    let [of_chain, of_striker] = STARTING_SHARES.map(|share| 100.0 * share);
    Assumption {
        of: "assumed: damping where fits begin",
        value: STARTING_SHARES[0],
        in_words: format!("{of_chain} % of critical damping of a body for c_d, {of_striker} % for c_s"),
        decides: "nothing where fits from several starts agree, which `fit_to_tracks` counts",
        reason: "light damping of this chain's own bodies and contacts",
    }
}

fn scale_of_drives() -> Assumption {
    Assumption {
        of: "assumed: how well the fit to peak energies knows the drives' scale",
        value: DRIVE_SCALE_SIGMA,
        in_words: format!("to {} %", 100.0 * DRIVE_SCALE_SIGMA),
        decides: "how far drives of all recordings together may move in the fit to the peak energies",
        reason: "no body's onset tells it",
    }
}

fn scatter_of_masses() -> Assumption {
    Assumption {
        of: "assumed: how far masses may scatter, where the tracks ask for it",
        value: UNSTATED_MASS_SCATTER,
        in_words: format!("by {} % (chain.mass_scatter)", 100.0 * UNSTATED_MASS_SCATTER),
        decides: "how large each body's own mass may be when structure in the tracks is explained by masses that differ",
        reason: "wide beside the 1.3 % of printed cylinders",
    }
}

fn scatter_of_stiffness() -> Assumption {
    Assumption {
        of: "assumed: how far contacts' stiffness may scatter, where the tracks ask for it",
        value: UNSTATED_STIFFNESS_SCATTER,
        in_words: format!("by {} % (contact.stiffness_scatter)", 100.0 * UNSTATED_STIFFNESS_SCATTER),
        decides: "how large each gap's own stiffness may be when structure in the tracks is explained by contacts that differ",
        reason: "wide beside the 5 % of printed cylinders",
    }
}

fn bodies_hardly_alike() -> Assumption {
    Assumption {
        of: "assumed: how likely masses or contacts scatter by as little as the tracks do not tell",
        value: ODDS_OF_SCATTER,
        in_words: format!("odds of {ODDS_OF_SCATTER} against bodies that are alike"),
        decides: "how much bodies that are not quite alike widen the sigmas of the damping, the strikers and the triggers",
        reason: "no two bodies are alike, and by how much they differ is not known",
    }
}

fn causes() -> Assumption {
    Assumption {
        of: "assumed: how likely each cause is that the experiment does not state",
        value: ODDS_OF_A_CAUSE,
        in_words: format!(
            "odds of {ODDS_OF_A_CAUSE} against the model as stated, and of {SIGMAS_OF_A_CAUSE} standard errors in its numbers"
        ),
        decides: "how much causes that the tracks do not tell widen the sigma of the damping",
        reason: "of a dozen causes an experiment has one, if any; what is much larger is told, what is much smaller does no harm",
    }
}
