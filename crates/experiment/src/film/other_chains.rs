//! Chains that are not the paper's, one of each kind as a laboratory might film it, and the words by which a report names what they leave
//! uncertain.

use chainwave_synthetic::Specimen;

use super::rests_m;
use super::wrong_chains::{not_negative, positive};
use crate::configuration::{
    Contact, DriveTable, Experiment, FarStrikerTable, Law, Pattern, Synthetic, Trial,
};
use crate::error::Error;
use crate::input::numbers::{NotNegative, Positive};

/// A chain that an experiment is filmed with in place of its own; what it is is stated.
#[derive(Debug, Clone, Copy)]
pub struct OtherChain {
    /// Its name.
    pub name: &'static str,
    /// Words of which a warning has to say one for what it leaves uncertain to count as named; none where there is nothing to be named.
    pub causes: &'static [&'static str],
    build: fn(&mut Workshop<'_>) -> Result<(), Error>,
}

/// What another chain changes.
struct Workshop<'a> {
    experiment: &'a mut Experiment,
    synthetic: &'a mut Synthetic,
    trials: &'a mut Vec<Trial>,
}

impl OtherChain {
    /// One of each kind.
    pub const ALL: &'static [Self] = &[
        Self { name: "stiffening", causes: &[], build: stiffening },
        Self { name: "linear", causes: &[], build: linear },
        Self { name: "damped", causes: &[], build: damped },
        Self { name: "diatomic", causes: &[], build: diatomic },
        Self { name: "graded", causes: &[], build: graded },
        Self { name: "five", causes: &[], build: five },
        Self { name: "sixty", causes: &[], build: |shop| long(shop, &SIXTY) },
        Self { name: "three_hundred", causes: &[], build: |shop| long(shop, &THREE_HUNDRED) },
        Self { name: "two_strikers", causes: &["far_striker"], build: two_strikers },
        Self { name: "shaker", causes: &[], build: shaker },
        Self { name: "bistable", causes: &[], build: bistable },
    ];

    /// Puts the chain in place of an experiment's own, and says how it is filmed.
    ///
    /// # Errors
    /// An experiment that says nothing of its film, and a chain that makes no sense.
    pub fn replace(&self, experiment: &mut Experiment, trials: &mut Vec<Trial>) -> Result<(), Error> {
        let Some(mut synthetic) = experiment.synthetic.take() else {
            return Err(Error::Value(
                "expected a [synthetic] part that says what is filmed, found none".into(),
            ));
        };
        let built = (self.build)(&mut Workshop { experiment, synthetic: &mut synthetic, trials });
        experiment.synthetic = Some(synthetic);
        built
    }
}

/// A number above 0, of those written here.
fn above_0(value: f64) -> Positive {
    positive(value).unwrap_or(Positive::ONE)
}

impl Workshop<'_> {
    fn law(&mut self, law: Law) {
        self.experiment.contact = Contact::same(law);
    }

    fn power(&mut self, a: f64, delta_0_m: f64, p: f64) {
        let [a, delta_0_m, p] = [a, delta_0_m, p].map(above_0);
        self.law(Law::Power { a, delta_0_m, p, sigmas: [None; 3] });
    }

    fn strike(&mut self, mass_kg: f64, velocity_m_per_s: f64) {
        let Some(striker) = &mut self.experiment.striker else { return };
        let scatter = striker.scatter();
        striker.mass_kg = above_0(mass_kg);
        striker.velocity_sigma_m_per_s = above_0(scatter * velocity_m_per_s);
        striker.velocity_m_per_s = above_0(velocity_m_per_s);
    }
}

/// Spheres of Hertz's law that are hardly pressed together: the overlap of the pulse is some thirty times that at rest, and the chain comes
/// apart behind it.
fn stiffening(shop: &mut Workshop<'_>) -> Result<(), Error> {
    shop.power(3.0e5, 5.0e-5, 1.5);
    shop.strike(0.91e-3, 2.73);
    Ok(())
}

/// Springs.
fn linear(shop: &mut Workshop<'_>) -> Result<(), Error> {
    shop.law(Law::Linear { k_n_per_m: above_0(1474.0), sigma: None });
    Ok(())
}

/// A heavy striker pushes a chain that loses its velocity within some milliseconds: pulses with flat tops.
fn damped(shop: &mut Workshop<'_>) -> Result<(), Error> {
    shop.strike(43.0e-3, 1.5);
    shop.synthetic.damping_kg_per_s = not_negative(0.1);
    Ok(())
}

/// Every second body three times as heavy.
fn diatomic(shop: &mut Workshop<'_>) -> Result<(), Error> {
    let repeat = [0.455e-3, 1.365e-3].map(above_0).to_vec();
    shop.experiment.chain.mass_kg = Pattern::Repeat { repeat };
    Ok(())
}

/// Bodies that grow lighter, less damped and nearer to each other.
fn graded(shop: &mut Workshop<'_>) -> Result<(), Error> {
    let chain = &mut shop.experiment.chain;
    chain.mass_kg = Pattern::Grade { grade: [0.6e-3, 0.3e-3].map(above_0) };
    chain.pitch_m = Pattern::Grade { grade: [0.032, 0.026].map(above_0) };
    chain.damping_kg_per_s = Some(Pattern::Grade { grade: [2.0, 1.0].map(not_negative) });
    shop.film_all(5)
}

/// Five bodies in one view.
fn five(shop: &mut Workshop<'_>) -> Result<(), Error> {
    shop.experiment.chain.n_bodies = 5;
    shop.film_all(5)
}

/// A second striker, from behind.
fn two_strikers(shop: &mut Workshop<'_>) -> Result<(), Error> {
    shop.experiment.far_striker = Some(FarStrikerTable {
        mass_kg: above_0(4.3e-3),
        velocity_m_per_s: not_negative(1.9),
        damping_kg_per_s: not_negative(0.2),
        distance_m: NotNegative::default(),
        contact: None,
    });
    Ok(())
}

/// No striker: body 1 is shaken within the chain's band, by an amplitude that scatters from trial to trial.
fn shaker(shop: &mut Workshop<'_>) -> Result<(), Error> {
    shop.experiment.striker = None;
    shop.experiment.drive = Some(DriveTable::Shaker {
        frequency_hz: above_0(250.0),
        amplitude_m: above_0(8e-4),
        ramp_s: Some(above_0(3e-3)),
        scatter: Some(above_0(0.02)),
    });
    shop.synthetic.striker_damping_kg_per_s = None;
    Ok(())
}

/// Gaps that snap from one state of rest to another, 3.2 mm shorter and lower in energy: a transition front.
fn bistable(shop: &mut Workshop<'_>) -> Result<(), Error> {
    let overlap_m = vec![-3e-3, -1e-3, 0.0, 0.6e-3, 1.2e-3, 2.0e-3, 2.6e-3, 3.2e-3, 4.2e-3, 5.2e-3];
    let force_n = vec![-3.0, -1.2, 0.0, 0.6, 0.3, -0.6, -0.9, 0.0, 1.5, 3.0];
    shop.law(Law::Table { file: None, overlap_m, force_n });
    shop.synthetic.damping_kg_per_s = not_negative(0.05);
    Ok(())
}

/// How a long chain is filmed: from farther away and slower, many bodies in a view.
struct LongChain {
    n_bodies: usize,
    in_view: usize,
    n_trials: u32,
    rate_hz: f64,
    /// Until the wave has reached the far end.
    duration_s: f64,
}

const SIXTY: LongChain =
    LongChain { n_bodies: 60, in_view: 16, n_trials: 3, rate_hz: 1e4, duration_s: 0.040 };
const THREE_HUNDRED: LongChain =
    LongChain { n_bodies: 300, in_view: 30, n_trials: 2, rate_hz: 5e3, duration_s: 0.190 };

fn long(shop: &mut Workshop<'_>, of: &LongChain) -> Result<(), Error> {
    /// A pitch of 30 px.
    const SCALE_PX_PER_M: f64 = 1000.0;
    /// The largest marker that leaves 5 px between it and its neighbour.
    const MARKER_HALF_M: f64 = 12.5e-3;
    const SUBSET_HALF_PX: usize = 7;
    shop.experiment.chain.n_bodies = of.n_bodies;
    shop.experiment.camera.scale_px_per_m = positive(SCALE_PX_PER_M);
    let tracking = &mut shop.experiment.tracking;
    (tracking.half_width_px, tracking.half_height_px) = (SUBSET_HALF_PX, SUBSET_HALF_PX);
    let synthetic = &mut *shop.synthetic;
    synthetic.camera.scale_px_per_m = SCALE_PX_PER_M;
    synthetic.camera.rate_hz = of.rate_hz;
    let marker = &mut synthetic.specimen.marker;
    (marker.half_width_m, marker.half_height_m) = (MARKER_HALF_M, MARKER_HALF_M);
    synthetic.n_frames =
        synthetic.first_image.unsigned_abs() as usize + (of.duration_s * of.rate_hz) as usize;
    let like = shop.trials.first().cloned();
    *shop.trials = (1..=of.n_trials)
        .filter_map(|trial| like.clone().map(|like| Trial { trial, view: 1, ..like }))
        .collect();
    shop.film_all(of.in_view)
}

impl Workshop<'_> {
    /// Films all bodies, so many in a view and one of them in common with the next, with as many trials of each view as the first one has.
    fn film_all(&mut self, in_view: usize) -> Result<(), Error> {
        /// What bodies go beyond where the last one rests, in pixels.
        const ROOM_PX: f64 = 70.0;
        let chain = &self.experiment.chain;
        let (n_bodies, rests_m) = (chain.n_bodies, rests_m(chain)?);
        let synthetic = &mut *self.synthetic;
        synthetic.specimen =
            Specimen { n_bodies, pitch_m: chain.mean_pitch_m(), ..synthetic.specimen.clone() };
        let widest_m =
            rests_m.windows(in_view).map(|rests| rests[in_view - 1] - rests[0]).fold(0.0, f64::max);
        let last_px = self.experiment.camera.first_body_px[0] + widest_m * synthetic.camera.scale_px_per_m;
        // Any packing takes whole groups of four pixels.
        synthetic.camera.width_px = ((last_px + ROOM_PX) as usize).next_multiple_of(4);
        let first = self.trials.first().map(|trial| trial.view);
        let like: Vec<Trial> =
            self.trials.iter().filter(|trial| Some(trial.view) == first).cloned().collect();
        let first_bodies = (0..n_bodies - 1).step_by(in_view - 1).map(|body| body.min(n_bodies - in_view));
        *self.trials = (1..)
            .zip(first_bodies)
            .flat_map(|(view, body)| {
                let stage_m = rests_m[body];
                like.iter().map(move |trial| Trial {
                    recording: format!("view{view}_trial{}.cine", trial.trial),
                    view,
                    stage_m,
                    ..trial.clone()
                })
            })
            .collect();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_body_of_every_chain_is_filmed() {
        let text = include_str!("../../../../tests/small-experiment/experiment.toml");
        let own: Experiment = toml::from_str(text).unwrap();
        let trial = |view: u32, stage_m: f64| Trial {
            recording: format!("view{view}_trial1.cine"),
            view,
            trial: 1,
            stage_m,
            scale_px_per_m: None,
            striker_velocity_m_per_s: None,
        };
        for chain in OtherChain::ALL {
            let (mut experiment, mut trials) =
                (own.clone(), vec![trial(1, 0.0), trial(2, 0.12), trial(3, 0.21)]);
            chain.replace(&mut experiment, &mut trials).unwrap();
            let synthetic = experiment.synthetic.as_ref().unwrap();
            let scale_px_per_m = synthetic.camera.scale_px_per_m;
            let half_px = experiment.tracking.half_width_px as f64;
            let rests_m = rests_m(&experiment.chain).unwrap();
            for (row, rest_m) in rests_m.iter().enumerate() {
                let body = row + 1;
                let is_seen = |trial: &&Trial| {
                    let column_px =
                        experiment.camera.first_body_px[0] + scale_px_per_m * (rest_m - trial.stage_m);
                    column_px >= half_px && column_px + half_px < synthetic.camera.width_px as f64
                };
                assert!(trials.iter().any(|trial| is_seen(&trial)), "{}: body {body}", chain.name);
            }
            assert_eq!(synthetic.specimen.n_bodies, experiment.chain.n_bodies, "{}", chain.name);
            toml::to_string(&experiment).unwrap();
        }
    }
}
