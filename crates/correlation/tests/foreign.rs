//! The methods that give a place and no covariance: what they have for bias and sigma is found on pictures of each subset. OpenCV's are
//! tested beside OpenCV.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]

mod support;

#[path = "support/foreign.rs"]
mod stated;

use chainwave_correlation::{CorrelationError, Method, ReferenceFrames, Settings};
use stated::{assert_coverage_of_noise, assert_lost_and_found, assert_mean_square_of_bias};
use support::{Wrong, grid, recorded};

#[test]
fn a_template_search_states_what_it_errs_by() {
    assert_coverage_of_noise("template-parabola", Wrong::Both);
    assert_mean_square_of_bias("template-parabola");
}

#[test]
fn a_template_search_loses_a_body_that_is_gone_and_finds_it_again() {
    assert_lost_and_found("template-parabola");
}

#[test]
fn methods_of_a_library_are_refused_without_it() {
    let film = recorded(vec![vec![0.0; support::SIZE[0] * support::SIZE[1]]; 2]);
    for name in ["opencv-lk", "opencv-ecc", "opencv-phase"] {
        let method: Method = name.parse().unwrap();
        let first = ReferenceFrames::Single(0);
        let refused = method.track(&film, &grid(110), &first, &Settings::default(), &|_| ());
        assert!(matches!(refused, Err(CorrelationError::NeedsOpenCv { method }) if method == name));
    }
}
