//! Orders of convergence of RK4, and the automatic choice's accuracy.

use chainwave_mechanics::{Chain, Contact, Integration, Law, Method, PowerLaw, Schedule, Tension, simulate};

use crate::scenes::{hec_chain, relative_error, run, striker};

/// Orders of convergence between successive halvings of the step, against a run of a step 16 times finer.
pub(crate) fn orders(chain: &Chain, duration_s: f64, steps_s: [f64; 4]) -> [f64; 3] {
    let truth = run(chain, duration_s, steps_s[3] / 16.0);
    let errors = steps_s.map(|dt_s| relative_error(&run(chain, duration_s, dt_s), &truth));
    [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2(), (errors[2] / errors[3]).log2()]
}

/// The finest step meets the theoretical order within 0.1, which higher terms of the error leave at these steps.
pub(crate) fn assert_order_four(orders: [f64; 3]) {
    assert!((orders[2] - 4.0).abs() < 0.1, "{orders:?}");
}

#[test]
fn the_error_falls_with_the_fourth_power_of_the_step() {
    let chain = hec_chain(26, 0.003, striker(2.73, 0.2));
    assert_order_four(orders(&chain, 0.02, [1e-4, 5e-5, 2.5e-5, 1.25e-5]));
}

/// After 34 ms the striker bounces on the chain. Each switch is the end of a step; stepping over it would leave an order
/// of one or two.
#[test]
fn switches_of_the_contact_cost_no_order() {
    for c_s in [0.0, 0.2] {
        let chain = hec_chain(60, 0.003, striker(2.73, c_s));
        assert_eq!(run(&chain, 0.042, 2e-5).contact_switch_times_s.len(), 9);
        assert_order_four(orders(&chain, 0.042, [1e-4, 5e-5, 2.5e-5, 1.25e-5]));
    }
}

/// Displacements lie within what was asked for and within what the run itself states, in gentle scenes and hard ones: the
/// experiment, a long chain, a striker that bounces, a tap, a blow beyond the law's range, stiffening laws, a contact without
/// precompression, strong dampers.
#[test]
fn the_automatic_choice_meets_its_accuracy_and_says_so() {
    let experiment = hec_chain(26, 0.003, striker(2.73, 0.2));
    let of_law = |delta_0_m: f64, p: f64| {
        let law = PowerLaw::from_stiffness(1474.0, delta_0_m, p).unwrap();
        Chain { contact: law.into(), ..experiment.clone() }
    };
    let scenes = [
        ("experiment", experiment.clone(), 0.02, Method::Dop853),
        ("long chain", hec_chain(120, 0.003, striker(2.73, 0.2)), 0.06, Method::Dop853),
        ("bouncing striker", hec_chain(60, 0.0, striker(2.73, 0.0)), 0.06, Method::Dop853),
        ("tap", hec_chain(26, 0.003, striker(0.01, 0.2)), 0.02, Method::Dop853),
        ("blow", hec_chain(26, 0.003, striker(12.0, 0.2)), 0.06, Method::Dop853),
        ("very hard blow", hec_chain(26, 0.0, striker(1e3, 0.0)), 0.06, Method::Dop853),
        ("stiffening", of_law(2e-3, 3.0), 0.03, Method::Dop853),
        ("Hertz without precompression", of_law(1e-6, 1.5), 0.03, Method::Dop853),
        ("small offset", of_law(1e-6, 0.5), 0.03, Method::Dop853),
        ("strong dampers", hec_chain(26, 10.0, striker(2.73, 0.2)), 0.1, Method::Esdirk4),
    ];
    for (name, chain, duration_s, method) in scenes {
        let to = |integration: Integration| {
            simulate(&chain, &Schedule { integration, ..Schedule::automatic(duration_s, 1e-3) }).unwrap()
        };
        let truth = to(Integration::Accuracy {
            method,
            accuracy: if method == Method::Dop853 { 1e-11 } else { 1e-9 },
        });
        for accuracy in [1e-3, 1e-4, 1e-6, 1e-8] {
            let found = to(Integration::Automatic { accuracy });
            let (error, stated) = (relative_error(&found, &truth), found.error_estimate.unwrap());
            assert!(
                error < accuracy && error < stated && stated < accuracy,
                "{name} to {accuracy:e}: {error:e} {stated:e}"
            );
        }
    }
}

/// Spheres that are pressed together by 2 N fly apart and collide some hundred times, and each collision multiplies the error: sums of the
/// steps' own errors were 40 times too small and more. Truth is another method with constant steps that are four times as short
/// as those of a run beside it: over bends of the force errors fall with a step's square, so that what the two differ by is far more than its error.
#[test]
fn collisions_that_multiply_errors_are_in_what_is_stated() {
    for speed_m_per_s in [0.5, 1.0, 2.73] {
        let law = Law::Power(PowerLaw::new(1.14e8, 6.75e-6, 1.5).unwrap());
        let contact = Contact { tension: Tension::Detach, ..Contact::from(law) };
        let drive = striker(speed_m_per_s, 0.05);
        let chain = Chain { contact: contact.into(), mass_kg: vec![1e-3; 8], ..hec_chain(8, 0.003, drive) };
        let to = |integration: Integration| {
            simulate(&chain, &Schedule { integration, ..Schedule::automatic(0.01, 1e-4) }).unwrap()
        };
        let [near, truth] = [1e-8, 2.5e-9].map(|dt_s| to(Integration::Steps { method: Method::Rk4, dt_s }));
        let unsure = relative_error(&near, &truth);
        let halved = (1e-4, Integration::Accuracy { method: Method::Rk4, accuracy: 1e-4 });
        let automatic = [1e-3, 1e-4, 1e-6].map(|accuracy| (accuracy, Integration::Automatic { accuracy }));
        for (accuracy, integration) in automatic.into_iter().chain([halved]) {
            let found = to(integration);
            assert!(found.tension_events > 50, "{} contacts opened", found.tension_events);
            let (error, stated) = (relative_error(&found, &truth), found.error_estimate.unwrap());
            assert!(
                error < stated + unsure && stated < accuracy,
                "{speed_m_per_s} m/s, {integration:?}: {error:e} +- {unsure:e}, {stated:e}"
            );
        }
    }
}

#[test]
fn the_automatic_choice_takes_no_more_steps_than_it_must() {
    let found =
        simulate(&hec_chain(26, 0.003, striker(2.73, 0.2)), &Schedule::automatic(0.02, 1e-4)).unwrap();
    // Twelve forces a step, one more at its end and three for the outputs inside. The steps are counted, 73 on every machine; a tenth
    // more would be a loss.
    assert!(found.steps <= 80 && found.force_evaluations <= 80 * 16 * 32, "{}", found.steps);
}
