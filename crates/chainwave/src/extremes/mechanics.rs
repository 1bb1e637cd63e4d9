//! The chain model at the ends of its parameters.

use chainwave_mechanics::{
    Bodies, Chain, Contact, Drive, FarEnd, Integration, Law, LinearLaw, Method, PowerLaw, Schedule,
    Simulation, Striker, Tension, simulate,
};

use super::{Family, decades, text};

/// Force and energy at 50 digits for the exact values of the doubles given: p, overlap, force, energy, with a = 60.1 and
/// delta_0 = 2.27e-3, for overlaps over delta_0 from 1e-18 to 1e6 and down to -1 + 1e-12.
const REFERENCE: &str = include_str!("../../../mechanics/tests/contact_reference.csv");

const MASS_KG: f64 = 0.455e-3;
const STRIKER_KG: f64 = 4.3e-3;
/// Stiffness at zero overlap of the experiment's chain.
const K_0_N_PER_M: f64 = 1474.0;

pub(super) fn families() -> Vec<Family> {
    [of_contacts(), of_chains(), Method::LADDER.map(order).into()].into_iter().flatten().collect()
}

fn of_contacts() -> Vec<Family> {
    vec![
        Family::new("contact force", "p", &[0.01, 0.114, 0.5, 1.0, 1.5, 3.0], "relative error", 2e-15, |p| {
            Ok(contact_error(p, 0))
        }),
        Family::new(
            "contact energy",
            "p",
            &[0.01, 0.114, 0.5, 1.0, 1.5, 3.0],
            "relative error",
            1e-13,
            |p| Ok(contact_error(p, 1)),
        ),
    ]
}

fn of_chains() -> Vec<Family> {
    vec![
        Family::new(
            "300 bodies for 150 ms, undamped",
            "accuracy",
            &[1e-6],
            "energy drift",
            1e-9,
            |accuracy| {
                let schedule =
                    Schedule { integration: Integration::Automatic { accuracy }, ..schedule(0.15) };
                Ok(run(&chain(PowerLaw::ELLIPTICAL_RING, 2.73, 300), &schedule)?.energy_drift)
            },
        ),
        Family::new("striker velocity", "velocity_m_per_s", &decades(-9, 3), AGREEMENT, 1e-6, |velocity| {
            disagreement(&chain(PowerLaw::ELLIPTICAL_RING, velocity, 26))
        })
        .or_refused(),
        Family::new("exponent", "p", &[0.01, 0.03, 0.1, 0.3, 1.0, 1.5, 3.0], AGREEMENT, 1e-6, |p| {
            disagreement(&chain(law(2.27e-3, p)?, 2.73, 26))
        })
        .or_refused(),
        Family::new(
            "offset at one stiffness",
            "delta_0_m",
            &decades(-12, 0),
            "energy drift",
            1e-6,
            |delta_0_m| {
                let chain = chain(law(delta_0_m, 0.114)?, 2.73, 26);
                Ok(run(&chain, &schedule(0.005))?.energy_drift)
            },
        )
        .or_refused(),
        // The smaller the offset, the stiffer the chain at rest: 3e11 N/m for 1e-12 m, which the pulse then softens.
        Family::new(
            "offset at one prefactor",
            "delta_0_m",
            &decades(-12, 0),
            "energy drift",
            1e-5,
            |delta_0_m| {
                let law = PowerLaw { delta_0_m, ..PowerLaw::ELLIPTICAL_RING };
                Ok(run(&chain(law, 2.73, 26), &schedule(0.005))?.energy_drift)
            },
        )
        .or_refused(),
        Family::new(
            "damping",
            "share_of_critical",
            &decades(-3, 6),
            AGREEMENT_CLOSED,
            1e-6,
            overdamped_error,
        )
        .or_refused(),
        Family::new("bodies", "n_bodies", &decades(1, 6), "relative difference to 200 bodies", 1e-9, |n| {
            many_bodies_error(n as usize)
        })
        .or_refused(),
    ]
}

const AGREEMENT: &str = "relative difference to another method";
const AGREEMENT_CLOSED: &str = "relative difference to the closed form";

/// The largest relative error of the force (0) or the energy (1) over the reference's overlaps.
fn contact_error(p: f64, which: usize) -> f64 {
    let law = Law::Power(PowerLaw { p, ..PowerLaw::ELLIPTICAL_RING });
    let contact = Contact { tension: Tension::Tangent { limit: -1.0 + 5e-13 }, ..Contact::from(law) };
    let mut largest = 0.0_f64;
    for line in REFERENCE.lines().skip(1) {
        let numbers: Vec<f64> = line.split(',').filter_map(|number| number.parse().ok()).collect();
        if let [row_p, overlap_m, truth @ ..] = &numbers[..]
            && row_p.to_bits() == p.to_bits()
        {
            let (force_n, energy_j) = contact.force_and_energy(*overlap_m);
            largest = largest.max(([force_n, energy_j][which] / truth[which] - 1.0).abs());
        }
    }
    largest
}

/// The larger of the energy drift and the difference of displacements between the automatic choice and the symplectic method
/// of order 6, which shares neither formulas nor steps with it.
fn disagreement(chain: &Chain) -> Result<f64, String> {
    let schedule = schedule(0.012);
    let found = run(chain, &schedule)?;
    let integration = Integration::Accuracy { method: Method::Symplectic6, accuracy: 1e-7 };
    let other = run(chain, &Schedule { integration, ..schedule })?;
    Ok(relative_difference(&found, &other).max(found.energy_drift))
}

/// One body on a wall's spring, let go from rest: x / x_0 = (r_2 e^(r_1 t) - r_1 e^(r_2 t)) / (r_2 - r_1) with the roots of
/// m r^2 + c r + k = 0, or its oscillating form.
fn overdamped_error(share_of_critical: f64) -> Result<f64, String> {
    let omega = (K_0_N_PER_M / MASS_KG).sqrt();
    // Long enough for the slow root to show, in a hundred outputs.
    let duration_s = 3.0 * share_of_critical.max(1.0) / omega;
    let chain = Chain {
        mass_kg: vec![MASS_KG],
        damping_kg_per_s: vec![2.0 * share_of_critical * (K_0_N_PER_M * MASS_KG).sqrt()],
        ground_stiffness_n_per_m: Vec::new(),
        ground_law: None,
        contact: LinearLaw::new(K_0_N_PER_M).map_err(text)?.into(),
        drive: Drive::Free { displacement_m: vec![1e-3], velocity_m_per_s: vec![0.0] },
        far_end: FarEnd::Fixed,
    };
    let found = run(&chain, &Schedule::automatic(duration_s, duration_s / 100.0))?;
    let times_s = found.trajectory.times_s.iter();
    let errors = times_s
        .zip(found.trajectory.displacement_m.row(0))
        .map(|(time_s, x_m)| (x_m / 1e-3 - damped_oscillation(share_of_critical, omega * time_s)).abs());
    Ok(errors.fold(0.0, f64::max))
}

/// The oscillator's displacement over its first one, for a damping over the critical and an angle omega t.
fn damped_oscillation(zeta: f64, angle: f64) -> f64 {
    if zeta < 1.0 {
        let root = (1.0 - zeta * zeta).sqrt();
        return (-zeta * angle).exp() * ((root * angle).cos() + zeta / root * (root * angle).sin());
    }
    if zeta > 1.0 {
        let fast = -zeta - (zeta * zeta - 1.0).sqrt();
        let slow = 1.0 / fast;
        return (fast * (slow * angle).exp() - slow * (fast * angle).exp()) / (fast - slow);
    }
    (1.0 + angle) * (-angle).exp()
}

/// The first bodies' motion while the wave has not come back from either chain's end.
fn many_bodies_error(n_bodies: usize) -> Result<f64, String> {
    let duration_s = 0.002;
    let schedule = Schedule::automatic(duration_s, duration_s);
    let few = run(&chain(PowerLaw::ELLIPTICAL_RING, 2.73, 200), &schedule)?;
    let many = run(&chain(PowerLaw::ELLIPTICAL_RING, 2.73, n_bodies), &schedule)?;
    let n_compared = n_bodies.min(5);
    let end = |simulation: &Simulation, body: usize| simulation.trajectory.displacement_m[(body, 1)];
    let differences = (0..n_compared).map(|body| (end(&few, body) - end(&many, body)).abs());
    Ok(differences.fold(0.0, f64::max) / end(&few, 0))
}

/// The measured order of a method on a smooth run, against that of theory.
fn order(method: Method) -> Family {
    let name = match method {
        Method::SymplecticEuler => "order of symplectic-euler",
        Method::Verlet => "order of verlet",
        Method::Symplectic4 => "order of symplectic4",
        Method::Symplectic6 => "order of symplectic6",
        Method::Rk4 => "order of rk4",
        Method::Dop853 => "order of dop853",
        Method::Esdirk4 => "order of esdirk4",
        _ => "order",
    };
    let expected = f64::from(method.order());
    Family::new(name, "order", &[expected], "departure from the order", 0.1, move |expected| {
        let chain = Chain { damping_kg_per_s: vec![0.003; 26], ..chain(PowerLaw::ELLIPTICAL_RING, 2.73, 26) };
        let with_steps = |method: Method, dt_s: f64| {
            run(&chain, &Schedule { bodies: Bodies::All, ..Schedule::with_steps(0.008, 0.004, method, dt_s) })
        };
        let truth = with_steps(Method::Dop853, 1e-5)?;
        let coarse_s = match method.order() {
            8 => 4e-4,
            6 => 2e-4,
            4 => 4e-5,
            _ => 2e-5,
        };
        // Of the velocities: displacements of a chain struck at rest gain an order by symplectic-euler's kinship to verlet.
        let velocity = |simulation: &Simulation| simulation.trajectory.velocity_m_per_s.clone();
        let truth = velocity(&truth);
        let error = |dt_s: f64| -> Result<f64, String> {
            let difference = velocity(&with_steps(method, dt_s)?) - &truth;
            Ok(difference.iter().fold(0.0_f64, |largest, v| largest.max(v.abs())))
        };
        Ok(((error(coarse_s)? / error(0.5 * coarse_s)?).log2() - expected).abs())
    })
}

/// `n_bodies` of the experiment, undamped.
fn chain(law: PowerLaw, velocity_m_per_s: f64, n_bodies: usize) -> Chain {
    Chain {
        mass_kg: vec![MASS_KG; n_bodies],
        damping_kg_per_s: vec![0.0; n_bodies],
        ground_stiffness_n_per_m: Vec::new(),
        ground_law: None,
        contact: law.into(),
        drive: Drive::Striker(Striker {
            mass_kg: STRIKER_KG,
            velocity_m_per_s,
            damping_kg_per_s: 0.0,
            ground_damping_kg_per_s: 0.0,
        }),
        far_end: FarEnd::Free,
    }
}

/// A law of the ring's stiffness.
fn law(delta_0_m: f64, p: f64) -> Result<PowerLaw, String> {
    PowerLaw::from_stiffness(K_0_N_PER_M, delta_0_m, p).map_err(text)
}

fn schedule(duration_s: f64) -> Schedule {
    Schedule::automatic(duration_s, duration_s / 50.0)
}

fn run(chain: &Chain, schedule: &Schedule) -> Result<Simulation, String> {
    simulate(chain, schedule).map_err(text)
}

/// Largest difference of displacement over the largest displacement.
fn relative_difference(found: &Simulation, other: &Simulation) -> f64 {
    let pairs = || found.trajectory.displacement_m.iter().zip(&other.trajectory.displacement_m);
    let largest = pairs().fold(0.0_f64, |largest, (x, _)| largest.max(x.abs()));
    pairs().fold(0.0_f64, |largest, (x, y)| largest.max((x - y).abs())) / largest
}
