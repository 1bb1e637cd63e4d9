//! A measured motion as a table.

use chainwave_inference::AlignedMotion;
use chainwave_measurement::Estimate;
use chainwave_stitching::{Spread, Stitched};
use ndarray::Array2;

use crate::merging::side_motion::SideMotion;
use crate::tables::result_table::{ResultTable, column};

/// The stitched motion: `t_s, body, x_m, sigma_m`, what was tracked across the chain and of rotation, and `n_trials, within_trial_m,
/// between_trials_m`; a row for each body and time where it was measured.
pub fn motion_table(stitched: &Stitched, side_motion: Option<&SideMotion>) -> ResultTable {
    let motion = &stitched.motion;
    let beside = Beside { spread: &stitched.spread, n_trials: &motion.n_trials, side_motion };
    table_of(&motion.times_s, &motion.displacement_m, &beside)
}

/// The motion aligned by the chain model, with the same columns.
pub fn motion_by_model_table(
    motion: &AlignedMotion,
    stitched: &Stitched,
    side_motion: &SideMotion,
) -> ResultTable {
    let beside =
        Beside { spread: &stitched.spread, n_trials: &motion.n_trials, side_motion: Some(side_motion) };
    table_of(&motion.times_s, &motion.displacement_m, &beside)
}

/// Walks an array over (row, time) by time, as the tables are ordered, and keeps what was measured.
pub(crate) fn by_time(
    values: &Array2<Option<Estimate>>,
) -> impl Iterator<Item = (usize, usize, Estimate)> + '_ {
    let (n_rows, n_times) = values.dim();
    let places = (0..n_times).flat_map(move |i| (0..n_rows).map(move |row| (row, i)));
    places.filter_map(|(row, i)| Some((row, i, values[(row, i)]?)))
}

/// What stands beside the displacement in a table of a motion.
struct Beside<'a> {
    spread: &'a Spread,
    n_trials: &'a Array2<u32>,
    side_motion: Option<&'a SideMotion>,
}

/// The table of a motion, which has a row for each body and time where it was measured; across the chain and rotation where anything of
/// them was.
fn table_of(times_s: &[f64], displacement_m: &Array2<Option<Estimate>>, beside: &Beside<'_>) -> ResultTable {
    let rows: Vec<(usize, usize, Estimate)> = by_time(displacement_m).collect();
    let of = |array: &Array2<f64>| rows.iter().map(|(row, i, _)| array[(*row, *i)]).collect::<Vec<_>>();
    let n_trials: Vec<u32> = rows.iter().map(|(row, i, _)| beside.n_trials[(*row, *i)]).collect();
    let mut columns = vec![
        column("t_s", rows.iter().map(|(_, i, _)| times_s[*i]).collect::<Vec<_>>()),
        column("body", rows.iter().map(|(row, ..)| *row as u32 + 1).collect::<Vec<_>>()),
        column("x_m", rows.iter().map(|(.., x)| x.value).collect::<Vec<_>>()),
        column("sigma_m", rows.iter().map(|(.., x)| x.sigma).collect::<Vec<_>>()),
    ];
    let across = beside.side_motion.and_then(|side| side.across.as_ref());
    let rotation = beside.side_motion.and_then(|side| side.rotation.as_ref());
    for (motion, names) in [(across, ["y_m", "sigma_y_m"]), (rotation, ["theta_rad", "sigma_theta_rad"])] {
        let Some(motion) = motion else { continue };
        let found = |(row, i, _): &(usize, usize, Estimate)| motion.displacement_m[(*row, *i)];
        columns.push(column(names[0], rows.iter().map(|at| Some(found(at)?.value)).collect::<Vec<_>>()));
        columns.push(column(names[1], rows.iter().map(|at| Some(found(at)?.sigma)).collect::<Vec<_>>()));
    }
    columns.extend([
        column("n_trials", n_trials),
        column("within_trial_m", of(&beside.spread.within_m)),
        column("between_trials_m", of(&beside.spread.between_m)),
    ]);
    ResultTable { columns }
}
