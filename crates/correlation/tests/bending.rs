//! Fields that bend: what the shape function cannot follow is taken off or stated, so intervals hold on both sides.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stdout, reason = "what each case gave is a table to be read")]

use std::num::NonZero;

use chainwave_correlation::{
    Field, FieldGrid, Reference, Settings, Shape, ShapeChoice, Window, correlate,
};
use chainwave_measurement::Region;
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture};

const SIZE_PX: [usize; 2] = [360, 360];
const MIDDLE_PX: [f64; 2] = [179.5, 179.5];
const AFFINE: ShapeChoice = ShapeChoice::Named(Shape::Affine);

struct Case {
    deformation: Deformation,
    noise: f64,
    seed: u64,
    grid: FieldGrid,
    choice: ShapeChoice,
}

impl Case {
    fn field(&self) -> Field {
        let surface = Surface::everywhere(
            Texture::speckles(self.seed, 4.5, MIDDLE_PX, [230.0; 2]),
            Deformation::NONE,
        );
        let deformed = surface.clone().deformed(self.deformation);
        let [before, after] = [(surface, 0), (deformed, 1)].map(|(surface, number)| {
            let mut tones = picture([1, 1], &[surface.clone()]).unwrap();
            tones = {
                let v = cached(&surface, self.seed, &self.deformation, number);
                let mut t = picture(SIZE_PX, &[]).unwrap();
                t.iter_mut().zip(v).for_each(|(t, v)| *t = v);
                let _ = tones;
                t
            };
            counts(&tones, 12, self.noise, self.seed, number).unwrap().into_raw_vec_and_offset().0
        });
        let whole = Region::whole(SIZE_PX[0], SIZE_PX[1]);
        let settings = Settings { convergence_px: std::env::var("CONV").map_or(1e-3, |v| v.parse().unwrap()), ..Settings::default() };
        let reference = Reference::new(whole, before, 1).unwrap().saturating_at(4095.0);
        let target = Window::new(whole, &after, settings.interpolation).unwrap();
        let n_threads = NonZero::new(1).unwrap();
        correlate(&reference, &target, self.grid, &settings, self.choice, n_threads, &|_| ()).unwrap()
    }

    /// Errors and sigmas of u and v.
    fn errors(&self) -> [Vec<[f64; 2]>; 2] {
        let field = self.field();
        [0, 1].map(|axis| {
            let error = |point: &chainwave_correlation::FieldPoint| {
                let place = [point.x_px, point.y_px];
                let found = point.found.as_ref().ok()?.position;
                let margin: f64 = std::env::var("INNER").map_or(0.0, |v| v.parse().unwrap());
                let inside = |v: f64| v >= 19.0 + margin && v <= 340.0 - margin;
                if !place.into_iter().all(inside) { return None; }
                let there = [found.x_px, found.y_px][axis];
                Some([there.value - self.deformation.displaced_px(place)[axis], there.sigma])
            };
            field.points.iter().filter_map(error).collect()
        })
    }
}

fn cached(surface: &Surface, seed: u64, d: &Deformation, number: u64) -> Vec<f64> {
    let key = if number == 0 { format!("/tmp/sb/r{seed}") } else { format!("/tmp/sb/d{seed}-{d:?}").replace(' ', "") };
    let n = SIZE_PX[0] * SIZE_PX[1];
    if let Ok(bytes) = std::fs::read(&key) {
        let v: Vec<f64> = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
        if v.len() == n { return v; }
    }
    let t = picture(SIZE_PX, &[surface.clone()]).unwrap();
    std::fs::write(&key, t.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
    t.iter().copied().collect()
}

#[test]
#[ignore = "prints"]
fn profile() {
    let env = |name: &str, usual: f64| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(usual);
    let period_px = env("P", 100.0);
    let deformation = Deformation::Wave { amplitude_px: [0.0, env("AMP", 0.5)], along: [1.0, 0.0], period_px };
    let choice = [AFFINE, ShapeChoice::ByEvidence, ShapeChoice::Named(Shape::Quadratic)][env("CHOICE", 2.0) as usize];
    let grid = FieldGrid { step_px: 8, half_px: 16 };
    let mut by_x = std::collections::BTreeMap::<i64, Vec<(f64, f64)>>::new();
    for seed in 1..=env("SEEDS", 2.0) as u64 {
        let field = Case { deformation, noise: env("NOISE", 0.0), seed, grid, choice }.field();
        for p in &field.points {
            if p.y_px < 60.0 || p.y_px > 300.0 { continue; }
            let f = p.found.as_ref().unwrap().position;
            by_x.entry(p.x_px as i64).or_default().push((f.y_px.value - deformation.displaced_px([p.x_px, p.y_px])[1], f.y_px.sigma));
        }
    }
    for (x, e) in by_x {
        let n = e.len() as f64;
        let m = e.iter().map(|e| e.0).sum::<f64>() / n;
        let sd = (e.iter().map(|e| (e.0 - m).powi(2)).sum::<f64>() / n).sqrt();
        let s = e.iter().map(|e| e.1).sum::<f64>() / n;
        println!("x {x} v {:7.1} mean error {:7.2} sd {:6.2} sigma {:6.2}", 1e3 * deformation.displacement_px([x as f64, 0.0])[1], 1e3 * m, 1e3 * sd, 1e3 * s);
    }
}

#[test]
#[ignore = "prints"]
fn look() {
    let env = |name: &str, usual: f64| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(usual);
    let (step_px, half_px) = (env("STEP", 8.0) as usize, env("HALF", 16.0) as usize);
    let turn = env("TURN", 0.0);
    let n = env("SEEDS", 2.0) as u64;
    for noise in [0.002, 0.01, 0.03] {
 if env("NOISE", 0.0) > 0.0 && env("NOISE", 0.0) != noise { continue; }
        for (name, choice) in [("affine", AFFINE), ("auto", ShapeChoice::ByEvidence), ("quadratic", ShapeChoice::Named(Shape::Quadratic))] {
            if env("CHOICE", -1.0) >= 0.0 && name != ["affine", "auto", "quadratic"][env("CHOICE", 0.0) as usize] { continue; }
            for period_px in [40.0, 50.0, 70.0, 100.0, 150.0, 200.0, 400.0, 1e9] {
                let along = [turn.cos(), turn.sin()];
                let a = env("AMP", 0.5);
                let deformation = Deformation::Wave { amplitude_px: [0.0, a], along, period_px };
                let grid = FieldGrid { step_px, half_px };
                let mut of: [Vec<[f64; 2]>; 2] = [Vec::new(), Vec::new()];
                for seed in 1..=n {
                    let errors = Case { deformation, noise, seed, grid, choice }.errors();
                    (0..2).for_each(|axis| of[axis].extend(&errors[axis]));
                }
                let told = of.map(|e| {
                    let share = |k: f64| 100.0 * e.iter().filter(|[e, s]| e.abs() < k * s).count() as f64 / e.len() as f64;
                    let rms = (e.iter().map(|[e, _]| e * e).sum::<f64>() / e.len() as f64).sqrt();
                    let mut s: Vec<f64> = e.iter().map(|e| e[1]).collect();
                    s.sort_by(f64::total_cmp);
                    let rs = (s.iter().map(|s| s * s).sum::<f64>() / s.len() as f64).sqrt();
                    format!("68:{:5.1} 95:{:5.1} rms {:6.2} sigma med {:6.2} rms {:6.2}", share(1.0), share(1.96), 1e3 * rms, 1e3 * s[s.len() / 2], 1e3 * rs)
                });
                println!("noise {noise} {name:9} P {period_px:6.0} u {} | v {}", told[0], told[1]);
            }
        }
    }
}
