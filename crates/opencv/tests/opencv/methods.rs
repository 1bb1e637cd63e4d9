//! OpenCV's methods state what they err by, and lose a body that is gone.

use crate::films::count_a_million;
use crate::stated::{assert_coverage_of_noise, assert_lost_and_found, assert_mean_square_of_bias};
use crate::support::Wrong;

#[test]
fn lucas_and_kanade_state_what_they_err_by() {
    chainwave_opencv::register();
    assert_coverage_of_noise("opencv-lk", Wrong::TooNarrow);
    assert_mean_square_of_bias("opencv-lk");
}

#[test]
fn enhanced_correlation_states_what_it_errs_by() {
    chainwave_opencv::register();
    assert_coverage_of_noise("opencv-ecc", Wrong::TooNarrow);
    assert_mean_square_of_bias("opencv-ecc");
}

#[test]
fn phase_correlation_states_what_it_errs_by() {
    chainwave_opencv::register();
    // At 0.2 % noise its intervals are too narrow: they hold 61 and 84 %, which the ladder states.
    assert_coverage_of_noise("opencv-phase", Wrong::TooNarrow);
}

#[test]
fn enhanced_correlation_loses_a_body_that_is_gone_and_finds_it_again() {
    chainwave_opencv::register();
    assert_lost_and_found("opencv-ecc");
}

#[test]
#[ignore = "a count of a million readings, which takes the better part of an hour"]
fn less_than_one_in_a_million_is_false() {
    chainwave_opencv::register();
    count_a_million(&["opencv-ecc", "opencv-phase", "opencv-lk"].map(|name| (name, 16)));
}
