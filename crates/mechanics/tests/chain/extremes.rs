//! What lies at the ends of the chain model's range: finite and right, or refused with a reason.

use chainwave_mechanics::{
    Chain, Contact, Drive, ImposedMotion, Integration, Law, MechanicsError, Method, PowerLaw, Schedule,
    TableLaw, Tension, simulate,
};

use crate::scenes::{hec_chain, run, striker};

fn automatic(chain: &Chain, duration_s: f64) -> Result<chainwave_mechanics::Simulation, MechanicsError> {
    simulate(chain, &Schedule::automatic(duration_s, 1e-4))
}

/// From a tap to a blow. From about 5 m/s the wave that comes back from the free end pulls gaps beyond the law's range; at
/// 1000 m/s it has not come back within 60 ms.
#[test]
fn any_striker_speed_ends_finite_and_keeps_the_energy() {
    // Smooth forces: the project's target. Where gaps pass the kink of the stiffness at the tension limit, or where a gap's
    // stiffness changes a hundredfold within the pulse: the accuracy that is asked for.
    for (v, beyond_the_law, drift) in [
        (1e-9, false, 1e-9),
        (1e-3, false, 1e-9),
        (2.73, false, 1e-9),
        (12.0, true, 1e-6),
        (30.0, true, 1e-6),
        (1e3, false, 1e-6),
    ] {
        let simulation = automatic(&hec_chain(26, 0.0, striker(v, 0.0)), 0.06).unwrap();
        assert!(simulation.energy_drift < drift, "{v} m/s: {:e}", simulation.energy_drift);
        assert_eq!(simulation.tension_events > 0, beyond_the_law, "{v} m/s");
    }
}

#[test]
fn small_motions_are_proportional_to_the_strikers_speed() {
    let [tap, knock] = [1e-9, 1e-6].map(|v| run(&hec_chain(26, 0.003, striker(v, 0.2)), 0.02, 1e-5));
    let pairs = tap.trajectory.displacement_m.iter().zip(&knock.trajectory.displacement_m);
    let largest = knock.trajectory.displacement_m.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (tap, knock) in pairs {
        // The law departs from its tangent by Delta / delta_0 = 1e-6.
        assert!((1e3 * tap - knock).abs() < 1e-5 * largest);
    }
}

#[test]
fn any_law_ends_finite_and_keeps_the_energy() {
    for p in [0.01, 0.5, 1.0, 1.5, 3.0] {
        for delta_0_m in [1e-12, 1e-6, 1e-3, 1.0] {
            let contact = PowerLaw::from_stiffness(1474.0, delta_0_m, p).unwrap();
            for n_bodies in [1, 10] {
                let chain = Chain { contact: contact.into(), ..hec_chain(n_bodies, 0.0, striker(1e-3, 0.0)) };
                let drift = automatic(&chain, 0.002).unwrap().energy_drift;
                // An offset of 1e-12 m turns the stiffness by orders of magnitude within one step, where the contact begins and
                // ends. The accuracy of 1e-6 is that of displacements; an energy goes with their square, and with that of velocities.
                assert!(drift < 1e-5, "{n_bodies} bodies, p {p}, delta_0 {delta_0_m}: {drift:e}");
            }
        }
    }
}

#[test]
fn steps_beyond_stability_are_refused() {
    let chain = hec_chain(26, 0.0, striker(2.73, 0.0));
    // omega_max = 2 sqrt(k_0 / m) = 3641 rad/s, so the bound is 0.777 ms.
    let limit_s = 2.828 / (2.0 * (PowerLaw::ELLIPTICAL_RING.k_0_n_per_m() / 0.455e-3).sqrt());
    let at = |dt_s: f64| simulate(&chain, &Schedule::with_steps(0.02, 0.01, Method::Rk4, dt_s));
    let Err(MechanicsError::StepTooLarge { limit_s: found_s, .. }) = at(1.01 * limit_s) else {
        panic!("expected a refusal");
    };
    assert!((found_s / limit_s - 1.0).abs() < 1e-12);
    assert!(at(0.5 * limit_s).is_ok());
    let damped = hec_chain(26, 100.0, striker(2.73, 0.0));
    let schedule = Schedule::with_steps(1e-3, 1e-4, Method::Rk4, 2e-5);
    assert!(matches!(simulate(&damped, &schedule), Err(MechanicsError::StepTooLarge { .. })));
    assert!(automatic(&damped, 1e-3).is_ok());
}

#[test]
fn input_without_meaning_is_refused_by_name() {
    let good = hec_chain(3, 0.0, striker(1.0, 0.0));
    let refusal = |change: fn(&mut Chain)| {
        let mut chain = good.clone();
        change(&mut chain);
        automatic(&chain, 0.01).unwrap_err().to_string()
    };
    assert_eq!(
        refusal(|c| c.mass_kg[1] = 0.0),
        "mass_kg of body 2: expected a finite number above 0, found 0"
    );
    assert!(refusal(|c| c.mass_kg.clear()).starts_with("number of bodies: expected at least 1"));
    assert!(refusal(|c| c.damping_kg_per_s[2] = -1.0).starts_with("damping_kg_per_s of body 3"));
    assert!(refusal(|c| c.damping_kg_per_s.truncate(1)).contains("expected 3 entries, found 1"));
    assert!(
        refusal(|c| c.contact = PowerLaw { p: -0.1, ..PowerLaw::ELLIPTICAL_RING }.into())
            .starts_with("contact p")
    );
    assert!(refusal(|c| c.drive = striker(-1.0, 0.0)).starts_with("striker velocity_m_per_s"));
    assert!(refusal(|c| c.drive = striker(f64::NAN, 0.0)).starts_with("striker velocity_m_per_s"));
    let short = |c: &mut Chain| {
        let motion = ImposedMotion::from_samples(vec![0.0, 1e-3, 2e-3, 3e-3], vec![0.0; 4]).unwrap();
        c.drive = Drive::Imposed(motion);
    };
    assert!(refusal(short).contains("expected samples from 0 to 0.01 s, found 0 to 0.003 s"));
}

#[test]
fn schedules_without_meaning_are_refused() {
    let chain = hec_chain(3, 0.0, striker(1.0, 0.0));
    for (duration_s, output_interval_s, dt_s) in [
        (0.0, 1e-4, None),
        (1e-5, 1e-4, None),
        (1e-2, f64::INFINITY, None),
        (1e-2, 1e-4, Some(0.0)),
        (1e9, 1e-4, None),
        (1.0, 0.5, Some(1e-13)),
    ] {
        let schedule = match dt_s {
            Some(dt_s) => Schedule::with_steps(duration_s, output_interval_s, Method::Rk4, dt_s),
            None => Schedule::automatic(duration_s, output_interval_s),
        };
        assert!(simulate(&chain, &schedule).is_err(), "{schedule:?}");
    }
}

/// Heavy bodies that hardly press on each other, shaken apart: dashpots much faster than the springs end with their contacts,
/// and a step over such an end takes the clock as far as it takes the bodies.
#[test]
fn a_shaken_chain_opens_its_damped_contacts_in_few_steps() {
    let (amplitude_m, omega_rad_per_s, duration_s) = (4e-5, 2.7, 2.0);
    let times_s: Vec<f64> = (0..=2000).map(|k| f64::from(k) * 1e-3).collect();
    let shaken_m = times_s.iter().map(|t| amplitude_m * (omega_rad_per_s * t).sin()).collect();
    let contact = Contact {
        law: Law::Power(PowerLaw::from_stiffness(8.0, 7e-8, 1.5).unwrap()),
        tension: Tension::Detach,
        damping_kg_per_s: 2800.0,
    };
    let chain = Chain {
        mass_kg: vec![90.0; 9],
        contact: contact.into(),
        ..hec_chain(9, 0.0, Drive::Imposed(ImposedMotion::from_samples(times_s, shaken_m).unwrap()))
    };
    let chosen = simulate(&chain, &Schedule::automatic(duration_s, 1e-2)).unwrap();
    assert_eq!(chosen.method, "esdirk4");
    assert!(chosen.tension_events > 0, "no contact opened");
    // A step is found within 20 trials where a contact opens, and grows back within 20 more; each has 5 stages of a few
    // corrections. 200 outputs and a hundred switches ask for no more than this.
    assert!(chosen.force_evaluations < 9 * (200 + 100) * 40 * 5 * 6, "{}", chosen.force_evaluations);
    let dt_s = 2e-5;
    let integration = Integration::Steps { method: Method::Rk4, dt_s };
    let expected =
        simulate(&chain, &Schedule { integration, ..Schedule::automatic(duration_s, 1e-2) }).unwrap();
    let (found, expected) = (&chosen.trajectory.displacement_m, &expected.trajectory.displacement_m);
    let largest_m = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let error_m = found.iter().zip(expected).fold(0.0_f64, |m, (one, other)| m.max((one - other).abs()));
    // The plain solver's constant steps pass each jump of the forces anywhere within a step: c h / m of the speed there, so that
    // part of the way made since.
    assert!(error_m < 2800.0 * dt_s / 90.0 * largest_m, "{error_m:e} of {largest_m:e}");
}

/// Struck hard enough, bodies leave a table whose force falls at its end: along the tangent they would fall into each other for ever.
#[test]
fn a_table_is_not_left_where_its_force_falls() {
    let struck = |forces_n: &[f64], v| {
        let law = TableLaw::new(&[-1e-3, 0.0, 1e-3, 2e-3], forces_n).unwrap();
        let contact = Contact { law: Law::Table(law), tension: Tension::default(), damping_kg_per_s: 0.0 };
        automatic(&Chain { contact: contact.into(), ..hec_chain(5, 0.0, striker(v, 0.0)) }, 0.02)
    };
    let (rises, falls) = ([-1.5, 0.0, 1.5, 3.0], [-1.5, 0.0, 1.5, 1.0]);
    let beyond = struck(&falls, 3.0);
    assert!(matches!(beyond, Err(MechanicsError::BeyondTable { gap: 0, .. })), "{beyond:?}");
    // Within the points, and beyond them where the force goes on to rise, the motion stands.
    assert!(struck(&falls, 0.1).is_ok() && struck(&rises, 3.0).is_ok());
}

/// What takes more steps than the chain's oscillation asks for is given up by their count, on every machine alike.
#[test]
fn motions_that_would_take_for_ever_are_refused() {
    let chain = hec_chain(5, 0.003, striker(2.73, 0.2));
    // A body of no mass to speak of, which its neighbours swing 1e149 times: with dampers an implicit method steps over that.
    let mut light = chain.clone();
    light.mass_kg[2] = 1e-300;
    assert!(automatic(&light, 0.02).unwrap().steps < 5000);
    light.damping_kg_per_s.fill(0.0);
    let refused = automatic(&light, 0.02).unwrap_err().to_string();
    assert!(refused.contains("time steps times bodies") && refused.contains("SI units"), "{refused}");
    // A method of order 1 would have to take a hundred million steps for a radian, which two short runs tell.
    let integration = Integration::Accuracy { method: Method::SymplecticEuler, accuracy: 1e-9 };
    let refused = simulate(&chain, &Schedule { integration, ..Schedule::automatic(0.02, 1e-4) });
    let refused = refused.unwrap_err().to_string();
    assert!(
        refused.contains("time steps times bodies") && refused.contains("a coarser accuracy"),
        "{refused}"
    );
}
