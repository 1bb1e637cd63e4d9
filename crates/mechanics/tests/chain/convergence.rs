use chainwave_mechanics::{Chain, Schedule, simulate};

use crate::scenes::{hec_chain, relative_error, run, striker};

/// Orders of convergence between successive halvings of the step, against a run of a step 16 times finer.
fn orders(chain: &Chain, duration_s: f64, steps_s: [f64; 4]) -> [f64; 3] {
    let truth = run(chain, duration_s, steps_s[3] / 16.0);
    let errors = steps_s.map(|dt_s| relative_error(&run(chain, duration_s, dt_s), &truth));
    [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2(), (errors[2] / errors[3]).log2()]
}

/// The finest step meets the theoretical order within 0.1, which higher terms of the error leave at these steps.
fn assert_order_four(orders: [f64; 3]) {
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
        assert_eq!(run(&chain, 0.042, 2e-5).contact_switches, 9);
        assert_order_four(orders(&chain, 0.042, [1e-4, 5e-5, 2.5e-5, 1.25e-5]));
    }
}

#[test]
fn the_automatic_step_meets_its_accuracy() {
    let chain = hec_chain(26, 0.003, striker(2.73, 0.2));
    let automatic = simulate(&chain, &Schedule::automatic(0.02, 1e-4)).unwrap();
    // Measured 6e-11; the interface promises 1e-6.
    assert!(relative_error(&automatic, &run(&chain, 0.02, 1e-6)) < 1e-9);
    // Effort: at most 4000 steps, of four forces a gap and one or two to watch the striker.
    assert!(automatic.steps <= 4000 && automatic.force_evaluations <= 4000 * 4 * 27);
}
