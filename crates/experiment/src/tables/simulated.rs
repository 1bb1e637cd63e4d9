//! A computed motion as a table.

use chainwave_measurement::Trajectory;
use chainwave_mechanics::StrikerMotion;

use crate::tables::result_table::{ResultTable, column};

/// The motion, time by time: `t_s, body, x_m, v_m_per_s`; body 0 is the striker, and the one behind the last the far striker.
pub fn simulated_table(
    trajectory: &Trajectory,
    striker: Option<&StrikerMotion>,
    far_striker: Option<&StrikerMotion>,
) -> ResultTable {
    let (mut times, mut bodies, mut x, mut v) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (i, time_s) in trajectory.times_s.iter().enumerate() {
        let mut add = |body: u32, x_m: f64, v_m_per_s: f64| {
            times.push(*time_s);
            bodies.push(body);
            x.push(x_m);
            v.push(v_m_per_s);
        };
        if let Some(striker) = striker {
            add(0, striker.displacement_m[i], striker.velocity_m_per_s[i]);
        }
        for row in 0..trajectory.displacement_m.nrows() {
            let at = (row, i);
            add(row as u32 + 1, trajectory.displacement_m[at], trajectory.velocity_m_per_s[at]);
        }
        if let Some(striker) = far_striker {
            let behind = trajectory.displacement_m.nrows() as u32 + 1;
            add(behind, striker.displacement_m[i], striker.velocity_m_per_s[i]);
        }
    }
    let columns =
        vec![column("t_s", times), column("body", bodies), column("x_m", x), column("v_m_per_s", v)];
    ResultTable { columns }
}
