//! Every instruction set that the machine has gives the same bits: whole simulations, in a process each.

use chainwave_mechanics::{
    Bodies, Chain, Change, Contact, Contacts, Drive, FarEnd, Integration, Law, LinearLaw, Method, PowerLaw,
    Ring, RingChain, RingDrive, RingSchedule, RingStriker, Schedule, Simulation, TableLaw, Tension, simulate,
    simulate_rings, simulate_with_sensitivities,
};
use chainwave_testkit::hold_each_to_the_same_bits;

#[test]
fn every_instruction_set_gives_the_same_bits() {
    hold_each_to_the_same_bits("instruction_sets::every_instruction_set_gives_the_same_bits", 31, digests);
}

/// What each of several simulations computed, in a word each.
fn digests() -> Vec<String> {
    let mut digests: Vec<String> =
        chains().iter().map(|(name, simulation)| of_chain(name, simulation)).collect();
    let damped = struck(5, power().into(), 0.003);
    let changed = Chain { damping_kg_per_s: vec![0.006; 5], ..damped.clone() };
    let change = Change { below: damped.clone(), above: changed, width: 0.003 };
    let found = simulate_with_sensitivities(&damped, &Schedule::automatic(2e-3, 1e-4), &[change]).unwrap();
    digests.push(digest("sensitivity", found.derivatives[0].displacement_m.iter()));
    for velocity_m_per_s in [2.73, 12.0] {
        let rings = rings(velocity_m_per_s);
        assert_eq!(rings.wide_share > 0.0, velocity_m_per_s > 10.0, "both forms of the loop are asked");
        let peaks = rings.psi_max_j.iter().chain([&rings.energy_drift]);
        digests.push(digest("rings", rings.trajectory.displacement_m.iter().chain(peaks)));
    }
    digests
}

fn of_chain(name: &str, found: &Simulation) -> String {
    let motion = found.trajectory.displacement_m.iter().chain(&found.trajectory.velocity_m_per_s);
    let events = found.peak_times_s.iter().flatten().chain(&found.contact_switch_times_s);
    let energies = found.psi_max_j.iter().chain([&found.energy_drift]);
    let parts = [digest("motion", motion), digest("events", events), digest("energies", energies)];
    format!("{name}: {}, {} steps", parts.join(", "), found.steps)
}

/// The bits of all values in a word, behind a name.
fn digest<'a>(name: &str, values: impl Iterator<Item = &'a f64>) -> String {
    format!("{name} {:016x}", chainwave_testkit::digest(values.map(|value| value.to_bits())))
}

fn power() -> Contact {
    Law::Power(PowerLaw::ELLIPTICAL_RING).into()
}

fn struck(n_bodies: usize, contact: Contacts, damping_kg_per_s: f64) -> Chain {
    Chain { damping_kg_per_s: vec![damping_kg_per_s; n_bodies], contact, ..Chain::of_rings(n_bodies) }
}

/// All integrators on damped and undamped chains, rows of all lengths within a block of vectors, and gaps of all kinds of laws.
fn chains() -> Vec<(String, Simulation)> {
    let run = |chain: &Chain, schedule: Schedule| simulate(chain, &schedule).unwrap();
    let by_method = Method::LADDER.into_iter().flat_map(|method| {
        [0.0, 0.003].map(|damping_kg_per_s| {
            let chain = struck(26, power().into(), damping_kg_per_s);
            let schedule = Schedule::with_steps(4e-3, 1e-3, method, 4e-5);
            let found = run(&chain, Schedule { bodies: Bodies::All, ..schedule });
            (format!("{method} with dampers of {damping_kg_per_s} kg/s"), found)
        })
    });
    let by_length = (1..=17).map(|n| {
        let found = run(&struck(n, power().into(), 0.003), Schedule::automatic(6e-3, 1e-3));
        (format!("{n} bodies"), found)
    });
    let held = [Method::Verlet, Method::Rk4, Method::Dop853, Method::Esdirk4].map(|method| {
        let ground_stiffness_n_per_m = (0..26).map(|body| 100.0 * f64::from(body)).collect();
        let chain = Chain { ground_stiffness_n_per_m, ..struck(26, power().into(), 0.003) };
        (
            format!("{method} with springs to ground"),
            run(&chain, Schedule::with_steps(4e-3, 1e-3, method, 4e-5)),
        )
    });
    let others = [("mixed laws", run(&mixed(), Schedule::automatic(6e-3, 1e-3))), ("blow", blow())];
    by_method
        .chain(by_length)
        .chain(held)
        .chain(others.map(|(name, found)| (name.to_owned(), found)))
        .collect()
}

/// Power laws that differ, springs, a table, dashpots, and gaps that detach.
fn mixed() -> Chain {
    let table = TableLaw::new(&[-1e-3, 0.0, 1e-3, 4e-3], &[-2.0, 0.0, 1.2, 3.5]).unwrap();
    let contacts = (0..25_u8).map(|gap| match gap % 4 {
        0 => Law::Power(PowerLaw::new(60.0 + f64::from(gap), 2.27e-3, 0.114).unwrap()).into(),
        1 => Contact { tension: Tension::Detach, ..Law::Linear(LinearLaw::new(1474.0).unwrap()).into() },
        2 => Contact { damping_kg_per_s: 0.01, ..power() },
        _ => Law::Table(table.clone()).into(),
    });
    struck(26, Contacts::Each(contacts.collect()), 0.003)
}

/// A blow that takes gaps beyond the power law's tables.
fn blow() -> Simulation {
    let mut chain = struck(9, Contact { tension: Tension::Detach, ..power() }.into(), 0.0);
    if let Drive::Striker(striker) = &mut chain.drive {
        striker.velocity_m_per_s = 300.0;
    }
    let integration = Integration::Accuracy { method: Method::Dop853, accuracy: 1e-6 };
    simulate(&chain, &Schedule { integration, ..Schedule::automatic(6e-3, 1e-3) }).unwrap()
}

fn rings(velocity_m_per_s: f64) -> chainwave_mechanics::RingSimulation {
    let chain = RingChain {
        ring: Ring::PAPER,
        n_rings: 9,
        elements_per_ring: 16,
        damping_kg_per_s: 0.01,
        drive: RingDrive::Striker(RingStriker {
            mass_kg: 4.3e-3,
            velocity_m_per_s,
            contact_stiffness_n_per_m: 1e5,
            damping_kg_per_s: 0.2,
        }),
        far_end: FarEnd::Free,
    };
    let schedule =
        RingSchedule { duration_s: 1e-3, output_interval_s: 1e-4, dt_s: None, shapes: false, n_threads: 1 };
    simulate_rings(&chain, &schedule).unwrap()
}
