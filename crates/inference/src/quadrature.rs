//! The mean over drives that scatter, as a sum of two runs.

/// Weights and nodes of the two-point Gauss quadrature whose mean, mean square and mean cube are those of the deviations from
/// their mean; one node where they do not scatter.
pub(crate) fn quadrature(deviations: &[f64]) -> Vec<(f64, f64)> {
    let n = deviations.len().max(1) as f64;
    let mean = deviations.iter().sum::<f64>() / n;
    let moment =
        |power: i32| deviations.iter().map(|deviation| (deviation - mean).powi(power)).sum::<f64>() / n;
    let sigma = moment(2).sqrt();
    if sigma < 1e-12 {
        return vec![(1.0, mean)];
    }
    let skewness = moment(3) / sigma.powi(3);
    let root = (skewness * skewness + 4.0).sqrt();
    let (low, high) = (0.5 * (skewness - root), 0.5 * (skewness + root));
    vec![(high / root, mean + sigma * low), (-low / root, mean + sigma * high)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quadrature_has_the_first_three_moments() {
        let deviations = [0.01, -0.02, 0.03, 0.0, -0.005];
        let nodes = quadrature(&deviations);
        for power in 0..=3 {
            let wanted = deviations.iter().map(|x: &f64| (x - 0.003).powi(power)).sum::<f64>() / 5.0;
            let found: f64 = nodes.iter().map(|(weight, x)| weight * (x - 0.003).powi(power)).sum();
            // Rounding of terms of at most 1.
            assert!((found - wanted).abs() < 1e-15, "moment {power}");
        }
        assert_eq!(quadrature(&[0.0, 0.0]), vec![(1.0, 0.0)]);
    }
}
