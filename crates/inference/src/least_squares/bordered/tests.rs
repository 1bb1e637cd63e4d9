//! The equations against one dense least squares.

use super::*;

/// The solution of one dense least squares: first the shared unknowns, later those of each recording.
struct Dense {
    inverse: DMatrix<f64>,
    solution: DVector<f64>,
    /// Its sum of squares.
    least: f64,
    /// Amplitudes, which stand behind the shared unknowns.
    n_errors: usize,
    first_own: usize,
    /// A recording's own unknowns and its places at rest.
    n_of_recording: usize,
}

impl Dense {
    /// Where an unknown of a recording stands.
    fn place(&self, recording: usize, k: usize) -> usize {
        self.first_own + self.n_of_recording * recording + k
    }

    /// Variance of a sum of one of the recordings' own unknowns, each recording with its weight.
    fn variance(&self, k: usize, weights: &[f64]) -> f64 {
        let all = || weights.iter().enumerate();
        let pairs = all().flat_map(|(r, of_r)| all().map(move |(q, of_q)| (r, q, of_r * of_q)));
        pairs.map(|(r, q, weight)| weight * self.inverse[(self.place(r, k), self.place(q, k))]).sum()
    }

    /// Holds the variance of a sum of unknowns of all kinds against it.
    fn has_variance_of_sums(&self, joint: &JointCovariance, n_recordings: usize, tolerance: f64) {
        let n_shared = self.first_own - self.n_errors;
        let (of_all, of_second) = (Own::new(0.3, -0.7), Own::new(1.1, 0.4));
        let shared = DVector::from_fn(n_shared, |i, _| 0.5 - 0.8 * i as f64);
        let amplitudes = DVector::from_fn(self.n_errors, |i, _| 0.6 * i as f64 - 0.2);
        let mut weights = DVector::zeros(self.inverse.nrows());
        weights.rows_mut(0, n_shared).copy_from(&shared);
        weights.rows_mut(n_shared, self.n_errors).copy_from(&amplitudes);
        for r in 0..n_recordings {
            let own = if r == 1 { of_all + of_second } else { of_all };
            (0..N_OWN).for_each(|k| weights[self.place(r, k)] = own[k]);
        }
        let amplitudes = if self.n_errors > 0 { vec![amplitudes] } else { Vec::new() };
        let sum = Weights { of_all, of_each: &[(1, of_second)], amplitudes: &amplitudes, shared };
        let expected = weights.dot(&(&self.inverse * &weights));
        assert!((joint.variance(&sum) - expected).abs() < tolerance * expected.max(1.0));
    }

    /// Holds steps and covariances of the equations against it.
    fn is_found_by(&self, equations: &NormalEquations, n_recordings: usize, tolerance: f64) {
        let reduced = equations.reduced(0.0).unwrap();
        let system = reduced.system();
        let (step, covariance) = (system.step().unwrap(), system.covariance().unwrap());
        let own = reduced.own_steps(&step);
        let errors = OwnCovariance::of(&reduced, &covariance);
        let close = |found: f64, expected: f64| (found - expected).abs() < tolerance;
        // The recordings' scores, and what the prior of the amplitudes adds to them, are the gradient.
        let of_ties = equations.ties.iter().zip(&reduced.ties);
        let priors = of_ties.map(|(tie, behind)| behind.by_shared().tr_mul(&tie.amplitudes));
        let parts = reduced.scores().into_iter().chain(priors);
        let gradient = parts.fold(DVector::zeros(step.len()), |sum, one| sum + one);
        assert!((gradient + &system.side).amax() < tolerance);
        let fall = equations.fall(&step, &own);
        assert!(close(equations.chi_squared() - fall, self.least));
        // From the minimum back it rises by as much, and by more where amplitudes are held.
        let back = equations.length2(&step, &own) - fall;
        assert!(if equations.ties.is_empty() { close(back, 0.0) } else { back > -tolerance });
        for i in 0..equations.n_shared() {
            assert!(close(step[i], self.solution[i]), "{} {}", step[i], self.solution[i]);
            assert!((0..equations.n_shared()).all(|j| close(covariance[(i, j)], self.inverse[(i, j)])));
        }
        self.has_variance_of_sums(&JointCovariance::of(&reduced, &covariance), n_recordings, tolerance);
        let mean = vec![1.0 / n_recordings as f64; n_recordings];
        for (r, own) in own.iter().enumerate() {
            let mut alone = vec![0.0; n_recordings];
            alone[r] = 1.0;
            let about_mean: Vec<f64> = alone.iter().zip(&mean).map(|(one, mean)| one - mean).collect();
            for (k, own) in own.iter().enumerate() {
                assert!(close(*own, self.solution[self.place(r, k)]));
                assert!(close(errors.of_each[r][(k, k)], self.variance(k, &alone)));
                assert!(close(errors.about_mean[r][(k, k)], self.variance(k, &about_mean)));
                assert!(close(errors.of_mean[(k, k)], self.variance(k, &mean)));
            }
        }
    }
}

/// Three recordings of one track each, and two shared unknowns, against the same least squares as one dense matrix with the
/// places at rest among its unknowns.
#[test]
fn elimination_gives_the_dense_solution() {
    const N_SHARED: usize = 2;
    const N_RECORDINGS: usize = 3;
    let mut blocks: Vec<Block> = (0..N_RECORDINGS).map(|_| Block::new(N_SHARED, &[])).collect();
    let mut rests: Vec<RestSums> = (0..N_RECORDINGS).map(|_| RestSums::new(N_SHARED, 0)).collect();
    let n_unknowns = N_SHARED + 3 * N_RECORDINGS;
    let mut equations = NormalEquations::new(N_SHARED);
    let (mut rows, mut side) = (Vec::new(), Vec::new());
    for k in 0..36_u32 {
        let wave = |i: u32| ((1.7 + 0.37 * f64::from(i)) * f64::from(k) + 0.9 * f64::from(i * i)).sin();
        let recording = k as usize % N_RECORDINGS;
        let inverse_sigma = 1.0 + 0.5 * wave(6);
        let entries = &[wave(3), wave(4), wave(1), wave(2), wave(5)][..];
        let row = Row { entries, errors: Vec::new(), inverse_sigma };
        equations.add_row(&entries[N_OWN..]);
        blocks[recording].add_rows([row].into_iter(), &mut rests[recording]);
        let mut row = vec![0.0; n_unknowns];
        row[..N_SHARED].copy_from_slice(&[wave(1), wave(2)]);
        let first = N_SHARED + 3 * recording;
        row[first..first + 3].copy_from_slice(&[wave(3), wave(4), inverse_sigma]);
        rows.extend(row);
        side.push(-wave(5));
    }
    let dense = DMatrix::from_row_slice(36, n_unknowns, &rows);
    let inverse = (dense.transpose() * &dense).try_inverse().unwrap();
    let side = DVector::from_vec(side);
    let solution = &inverse * dense.transpose() * &side;
    let least = (&dense * &solution - side).norm_squared();
    for (recording, rest) in blocks.into_iter().zip(rests) {
        equations.add_recording(recording, &[rest]);
    }
    // Rounding, times a condition number of some tens.
    let dense = Dense { inverse, solution, least, n_errors: 0, first_own: N_SHARED, n_of_recording: 3 };
    dense.is_found_by(&equations, N_RECORDINGS, 1e-12);
}

/// Four recordings of two tracks each. The first three have two of three errors each: the first one in both tracks, the other one in the
/// second alone. Against one dense least squares with the places at rest and the amplitudes among its unknowns.
#[test]
fn ties_give_the_dense_solution() {
    const N_SHARED: usize = 2;
    const N_RECORDINGS: usize = 4;
    const N_TIED: usize = 3;
    const N_ERRORS: usize = 3;
    let first_own = N_SHARED + N_ERRORS;
    let n_unknowns = first_own + 4 * N_RECORDINGS;
    let mut equations = NormalEquations::new(N_SHARED);
    let (mut rows, mut side) = (Vec::new(), Vec::new());
    for recording in 0..N_RECORDINGS {
        let is_tied = recording < N_TIED;
        let of_recording = [[0, 1], [1, 2], [0, 2], [0, 0]][recording];
        let of_recording = if is_tied { &of_recording[..] } else { &[] };
        let mut block = Block::new(N_SHARED, of_recording);
        let mut rests = Vec::new();
        for track in 0..2 {
            let places = 0..if is_tied { track + 1 } else { 0 };
            let mut rest = RestSums::new(N_SHARED, of_recording.len());
            for k in 0..12 {
                let seed = f64::from(k) + 12.3 * track as f64 + 31.7 * recording as f64;
                let wave = |i: usize| ((1.7 + 0.37 * i as f64) * seed + 0.9 * (i * i) as f64).sin();
                let inverse_sigma = 1.0 + 0.5 * wave(6);
                let entries = &[wave(3), wave(4), wave(1), wave(2), wave(5)][..];
                let errors: Vec<(usize, f64)> =
                    places.clone().map(|place| (place, 3.0 * wave(7 + place))).collect();
                let row = Row { entries, errors: errors.clone(), inverse_sigma };
                equations.add_row(&entries[N_OWN..]);
                block.add_rows([row].into_iter(), &mut rest);
                let mut dense = vec![0.0; n_unknowns];
                dense[..N_SHARED].copy_from_slice(&entries[2..4]);
                for (place, slope) in errors {
                    dense[N_SHARED + of_recording[place]] = slope;
                }
                let own = first_own + 4 * recording;
                dense[own..own + 2].copy_from_slice(&entries[..2]);
                dense[own + 2 + track] = inverse_sigma;
                rows.extend(dense);
                side.push(-wave(5));
            }
            rests.push(rest);
        }
        equations.add_recording(block, &rests);
    }
    for error in 0..N_ERRORS {
        let mut prior = vec![0.0; n_unknowns];
        prior[N_SHARED + error] = 1.0;
        rows.extend(prior);
        side.push(0.0);
    }
    equations.tie(&(0..N_TIED).collect::<Vec<_>>(), N_ERRORS);
    let dense = DMatrix::from_row_slice(side.len(), n_unknowns, &rows);
    let side = DVector::from_vec(side);
    let inverse = (dense.transpose() * &dense).try_inverse().unwrap();
    let solution = &inverse * dense.transpose() * &side;
    let least = (&dense * &solution - &side).norm_squared();
    // Rounding, times a condition number of some hundreds.
    let tolerance = 1e-11;
    let solved = Dense { inverse, solution, least, n_errors: N_ERRORS, first_own, n_of_recording: 4 };
    solved.is_found_by(&equations, N_RECORDINGS, tolerance);
    let close = |found: f64, expected: f64| (found - expected).abs() < tolerance;
    let place = |r: usize, k: usize| solved.place(r, k);
    // The sum of squares is that of the amplitudes and places at rest that fit best, the other unknowns held.
    let free: Vec<usize> =
        (N_SHARED..first_own).chain((0..N_RECORDINGS).flat_map(|r| [place(r, 2), place(r, 3)])).collect();
    let part = dense.select_columns(&free);
    let best = (part.transpose() * &part).try_inverse().unwrap() * part.transpose() * &side;
    assert!(close(equations.chi_squared(), (&part * &best - &side).norm_squared()));
    let amplitudes = &equations.amplitudes()[0];
    assert!((0..N_ERRORS).all(|error| close(amplitudes[error], best[error])));
}

#[test]
fn products_of_many_unknowns_are_held_once_for_all_recordings() {
    let held = |n_shared: usize, n_recordings: usize| {
        let mut equations = NormalEquations::new(n_shared);
        (0..n_recordings).for_each(|_| equations.add_recording(Block::new(n_shared, &[]), &[]));
        equations.n_held()
    };
    for (n_shared, n_recordings) in [(300, 22), (1000, 70)] {
        let of_recordings = held(n_shared, n_recordings) - held(n_shared, 0);
        // Two own unknowns and the residual, each with themselves and the unknowns that all share.
        assert!(of_recordings <= n_recordings * (N_OWN + 1) * (N_OWN + n_shared + 1), "{of_recordings}");
    }
}

#[test]
fn sums_are_the_same_for_any_number_of_threads_and_those_of_the_rows_one_by_one() {
    const N_SHARED: usize = 37;
    let entry = |row: usize, i: usize| match (row / 5 + i).is_multiple_of(3) {
        true => 0.0,
        false => (1.3 * row as f64 + 0.7 * (i * i) as f64).sin(),
    };
    let rows: Vec<Vec<f64>> = (0..71).map(|row| (0..=N_SHARED).map(|i| entry(row, i)).collect()).collect();
    let rows: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
    let summed = |n_threads: usize| {
        let mut products = SharedProducts::new(N_SHARED);
        products.add_rows(&rows, n_threads.try_into().unwrap());
        products.damped(0.0)
    };
    let all = summed(1);
    assert_eq!(all, summed(3));
    for i in 0..=N_SHARED {
        for j in 0..=N_SHARED {
            let expected: f64 = rows.iter().map(|row| row[i] * row[j]).sum();
            // Rounding of a sum of 71 numbers below one.
            assert!((all[(i, j)] - expected).abs() < 71.0 * 71.0 * f64::EPSILON);
        }
    }
}

#[test]
fn recordings_without_information_are_singular() {
    assert!(Block::new(1, &[]).eliminated(0.0).is_none());
    let empty = NormalEquations::new(1).reduced(0.0).unwrap().system();
    assert!(empty.step().is_none());
    assert_eq!(empty.covariance(), Err(vec![0]));
}

#[test]
fn unknowns_that_stand_for_each_other_are_named() {
    let mut equations = NormalEquations::new(3);
    for k in 0..20 {
        let x = f64::from(k);
        // The first and the third are one.
        equations.add_row(&[x, x.cos(), 2.0 * x, x.sin()]);
    }
    assert_eq!(equations.reduced(0.0).unwrap().system().covariance(), Err(vec![0, 2]));
}
