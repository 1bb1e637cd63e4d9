#![allow(unsafe_code)]
use chainwave_mechanics::*;
use std::time::Instant;
fn main() {
    let args: Vec<f64> = std::env::args().skip(1).map(|a| a.parse().unwrap()).collect();
    let n = args.first().copied().unwrap_or(300.0) as usize;
    let ms = args.get(1).copied().unwrap_or(148.0);
    let threads = args.get(2).copied().unwrap_or(1.0) as usize;
    let kc = args.get(3).copied().unwrap_or(1e5);
    let ring = Ring {
        semi_major_m: 14.8e-3,
        semi_minor_m: 8.8e-3,
        wall_m: 0.4e-3,
        width_m: 12e-3,
        young_pa: 2.888e9,
        poisson: 0.35,
        density_kg_per_m3: 1237.0,
        bond_width_m: 0.0,
    };
    let run = |el: usize, dt: Option<f64>| {
        let chain = RingChain {
            ring,
            n_rings: n,
            elements_per_ring: el,
            damping_kg_per_s: 0.0,
            drive: RingDrive::Striker(RingStriker {
                mass_kg: 4.3e-3,
                velocity_m_per_s: 2.73,
                contact_stiffness_n_per_m: kc.abs(),
                damping_kg_per_s: 0.0,
            }),
            far_end: FarEnd::Free,
        };
        let cpu = || -> f64 {
            unsafe extern "C" {
                fn clock_gettime(c: i32, t: *mut [i64; 2]) -> i32;
            }
            let mut t = [0i64; 2];
            unsafe {
                clock_gettime(3, &mut t);
            }
            t[0] as f64 + 1e-9 * t[1] as f64
        };
        let c = cpu();
        let t = Instant::now();
        let c = cpu();
        let s = simulate_rings(
            &chain,
            &RingSchedule {
                duration_s: ms * 1e-3,
                output_interval_s: 1e-4,
                dt_s: dt,
                shapes: false,
                n_threads: threads,
            },
        )
        .unwrap();
        let w = if kc < 0.0 { cpu() - c } else { t.elapsed().as_secs_f64() };
        (s, w)
    };
    if kc < 0.0 {
        for el in [16, 32, 64] {
            let best = (0..60)
                .map(|_| {
                    let (s, w) = run(el, None);
                    w * 1e9 / s.element_steps as f64
                })
                .fold(f64::INFINITY, f64::min);
            println!("el {el} best {best:.3} ns/el-step");
        }
        return;
    }
    let reference = run(6, None).0;
    let xmax = reference.trajectory.displacement_m.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    for el in [16, 24] {
        let (s, w) = run(el, None);
        let err = s
            .trajectory
            .displacement_m
            .iter()
            .zip(&reference.trajectory.displacement_m)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0f64, f64::max)
            / xmax;
        println!(
            "el {el:3} err {err:.2e} wall {w:.3} s dt {:.2e} ns/el-step {:.3} exact {:.1e} drift {:.1e} mom {:?} switches {} steps {} share {:.3}",
            s.dt_s,
            w * 1e9 / s.element_steps as f64,
            s.wide_share,
            s.energy_drift,
            s.momentum_drift,
            s.contact_switches,
            s.steps,
            s.element_steps as f64 * 2.0 / (el * n) as f64 / s.steps as f64
        );
    }
    println!("xmax {xmax}");
}
