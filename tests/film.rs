//! Rings that breathe and ovalise in the film, as the ring model says; their markers stay rigid.

mod slow {
    use std::fs::{self, File};
    use std::path::Path;

    use tempfile::TempDir;
    use tiff::decoder::{Decoder, DecodingResult};

    use crate::support::command::{chainwave, succeed};
    use crate::support::laboratory::Laboratory;
    use crate::support::table::Table;

    const SCALE_PX_PER_M: f64 = 2500.0;
    const FIRST_BODY_PX: [f64; 2] = [38.0, 31.5];
    const WIDTH_PX: usize = 400;
    const RATE_HZ: f64 = 25e3;
    const FIRST_IMAGE: f64 = -40.0;
    /// Elements of the upper half of a ring.
    const N_ELEMENTS: usize = 12;
    const RINGS: &str = "
[synthetic.rings]
width_m = 12e-3
young_pa = 2.888e9
poisson = 0.35
density_kg_per_m3 = 1237.0
elements_per_ring = 24
contact_stiffness_n_per_m = 1e5
";

    /// One trial of the first view, high enough for rings that bulge, without the rods in front and almost without noise.
    fn laboratory() -> Laboratory {
        let laboratory = Laboratory::with_appended(RINGS);
        let mut plan = fs::read_to_string(laboratory.path("experiment.toml")).expect("it was written");
        for (from, to) in [
            ("height_px = 48", "height_px = 64"),
            ("first_body_px = [30.0, 23.5]", "first_body_px = [38.0, 31.5]"),
            ("n_frames = 330", "n_frames = 180"),
            ("below_axis_m = [-7e-3, 7e-3]", "below_axis_m = []"),
            ("read_noise_counts = 12.0", "read_noise_counts = 1.0"),
            ("counts_per_electron = 0.2", "counts_per_electron = 0.0"),
        ] {
            assert_eq!(plan.matches(from).count(), 1, "{from}");
            plan = plan.replace(from, to);
        }
        laboratory.write("experiment.toml", &plan);
        laboratory.write("trials.csv", "recording,view,trial,stage_m\nview1_trial1.cine,1,1,0.0\n");
        laboratory
    }

    /// Upper centrelines by the ring model, struck as the trial really was.
    struct Model {
        interval_s: f64,
        places_m: Vec<[f64; 2]>,
    }

    impl Model {
        fn of(striker_velocity_m_per_s: f64) -> Self {
            let folder = TempDir::new().expect("a temporary folder can be made");
            let scene = format!(
                "model = \"ring\"\nn_bodies = 12\nduration_s = 6e-3\noutput_interval_s = 1e-5\nshapes_file = \"shapes.csv\"\n\
                 [body]\npitch_m = 0.030\ndamping_kg_per_s = 0.003\n\
                 [ring]\nsemi_major_m = 14.8e-3\nsemi_minor_m = 8.8e-3\nwall_m = 0.4e-3\nwidth_m = 12e-3\nyoung_pa = 2.888e9\n\
                 poisson = 0.35\ndensity_kg_per_m3 = 1237.0\nelements_per_ring = 24\n\
                 [drive]\nkind = \"striker\"\nmass_kg = 4.3e-3\nvelocity_m_per_s = {striker_velocity_m_per_s:?}\n\
                 damping_kg_per_s = 0.2\ncontact_stiffness_n_per_m = 1e5\n"
            );
            let path = folder.path().join("scene.toml");
            fs::write(&path, scene).expect("a scene can be written");
            let out = folder.path().join("motion.csv");
            succeed(chainwave().arg("simulate").arg(&path).arg("--out").arg(&out));
            let shapes = Table::read(&folder.path().join("shapes.csv"));
            let places_m =
                shapes.full("x_m").into_iter().zip(shapes.full("y_m")).map(|(x_m, y_m)| [x_m, y_m]);
            Self { interval_s: 1e-5, places_m: places_m.collect() }
        }

        /// Nodes of a ring (from 0) in the picture, from its left pole over the top to the right one.
        fn nodes_px(&self, ring: usize, time_s: f64) -> Vec<[f64; 2]> {
            let k = (time_s / self.interval_s).floor();
            let share = time_s / self.interval_s - k;
            let at = |k: usize, node: usize| self.places_m[(k * 12 + ring) * (N_ELEMENTS + 1) + node];
            (0..=N_ELEMENTS)
                .map(|node| {
                    let (before, after) = (at(k as usize, node), at(k as usize + 1, node));
                    let [x_m, y_m] = [0, 1].map(|axis| (1.0 - share) * before[axis] + share * after[axis]);
                    // The ring's first pole is 14.8 mm before its body's centre; bodies stand 0.4 mm farther apart than poles.
                    let along_m = x_m - 14.8e-3 + 0.4e-3 * ring as f64;
                    let [column_px, row_px] = FIRST_BODY_PX;
                    [column_px + SCALE_PX_PER_M * along_m, row_px - SCALE_PX_PER_M * y_m]
                })
                .collect()
        }
    }

    fn picture(recording: &Path, frame: usize, folder: &TempDir) -> Vec<f64> {
        let path = folder.path().join("frame.tif");
        let mut command = chainwave();
        command.arg("inspect").arg(recording).arg("--frame").arg(frame.to_string()).arg("--out").arg(&path);
        succeed(&mut command);
        let mut decoder = Decoder::new(File::open(&path).expect("the frame")).expect("a TIFF");
        match decoder.read_image().expect("an image") {
            DecodingResult::U16(counts) => counts.into_iter().map(f64::from).collect(),
            _ => panic!("expected 16 bit"),
        }
    }

    /// Centre of the bright line that crosses a row of pixels near a place in it, above the straight line between the ends of
    /// the window.
    fn line_px(counts: impl Fn(usize) -> f64, near_px: f64) -> f64 {
        let (first, last) = ((near_px - 3.0).round() as usize, (near_px + 3.0).round() as usize);
        let slope = (counts(last) - counts(first)) / (last - first) as f64;
        let (weight, moment) = (first..=last).fold((0.0, 0.0), |(weight, moment), pixel| {
            let above = counts(pixel) - counts(first) - slope * (pixel - first) as f64;
            (weight + above, moment + above * pixel as f64)
        });
        moment / weight
    }

    /// Row of a ring's top at a column: the parabola through the three nodes around it.
    fn top_px(nodes_px: &[[f64; 2]], column: f64) -> f64 {
        let middle = (1..N_ELEMENTS)
            .min_by(|&a, &b| (nodes_px[a][0] - column).abs().total_cmp(&(nodes_px[b][0] - column).abs()))
            .expect("inner nodes");
        let [a, b, c] = [middle - 1, middle, middle + 1].map(|node| nodes_px[node]);
        let weight = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
            (column - q[0]) * (column - r[0]) / ((p[0] - q[0]) * (p[0] - r[0])) * p[1]
        };
        weight(a, b, c) + weight(b, a, c) + weight(c, a, b)
    }

    #[test]
    fn rings_in_the_film_bend_as_the_model_says_and_markers_tell_the_motion() {
        let laboratory = laboratory();
        let recordings = laboratory.film();
        let recording = recordings.join("view1_trial1.cine");
        let trial = Table::read(&recordings.join("truth_trials.csv"));
        let [velocity, delay_s, phase_s] =
            ["striker_velocity_m_per_s", "trigger_delay_s", "frame_phase_s"].map(|name| trial.full(name)[0]);
        let model = Model::of(velocity);
        let folder = TempDir::new().expect("a temporary folder can be made");
        let time_s = |frame: usize| (FIRST_IMAGE + frame as f64) / RATE_HZ + phase_s + delay_s;
        let mut largest_bulge_px = 0.0_f64;
        for frame in [60, 90, 120, 150] {
            let counts = picture(&recording, frame, &folder);
            for ring in 0..4 {
                let nodes_px = model.nodes_px(ring, time_s(frame));
                let column = (0.5 * (nodes_px[0][0] + nodes_px[N_ELEMENTS][0])).round() as usize;
                let expected_px = top_px(&nodes_px, column as f64);
                let found_px = line_px(|row| counts[row * WIDTH_PX + column], expected_px);
                // The wall is 1 px wide: the background's slope moves its centre by some hundredths.
                assert!((found_px - expected_px).abs() < 0.1, "{frame} {ring}: {found_px} {expected_px}");
                largest_bulge_px = largest_bulge_px.max(FIRST_BODY_PX[1] - 22.0 - found_px);
            }
            // Row 32 lies half a pixel below the axis, where the first pole's wall is hardly bent away.
            let expected_px = model.nodes_px(0, time_s(frame))[0][0];
            let found_px = line_px(|column| counts[32 * WIDTH_PX + column], expected_px);
            assert!((found_px - expected_px).abs() < 0.1, "{frame}: {found_px} {expected_px}");
        }
        assert!(largest_bulge_px > 2.0, "{largest_bulge_px}");
        held_by_its_marker(&recording, &recordings, &laboratory);
    }

    /// The first marker's track against the truth.
    fn held_by_its_marker(recording: &Path, recordings: &Path, laboratory: &Laboratory) {
        let points =
            laboratory.write("points.csv", "name,x_px,y_px,half_width_px,half_height_px\nbody1,38,31,9,9\n");
        let tracks = laboratory.path("tracks.csv");
        let mut command = chainwave();
        succeed(command.arg("track").arg(recording).arg("--points").arg(points).arg("--out").arg(&tracks));
        let (tracks, truth) = (Table::read(&tracks), Table::read(&recordings.join("truth.parquet")));
        let (times_s, bodies, x_m) = (truth.full("t_s"), truth.full("body"), truth.full("x_m"));
        let first: Vec<(f64, f64)> =
            (0..times_s.len()).filter(|&row| bodies[row] < 1.5).map(|row| (times_s[row], x_m[row])).collect();
        let true_px = |time_s: f64| {
            let after = first.partition_point(|(sample_s, _)| *sample_s < time_s).clamp(1, first.len() - 1);
            let ((from_s, from_m), (to_s, to_m)) = (first[after - 1], first[after]);
            SCALE_PX_PER_M * (from_m + (time_s - from_s) / (to_s - from_s) * (to_m - from_m))
        };
        let (found_px, at_s) = (tracks.full("x_px"), tracks.full("t_s"));
        for (x_px, time_s) in found_px.iter().zip(at_s).filter(|(_, time_s)| *time_s < 5e-3) {
            // 0.01 px: the tracker's bias and noise at 19 x 19 px are half that.
            assert!((x_px - 38.0 - true_px(time_s)).abs() < 0.01, "{time_s}: {x_px} {}", true_px(time_s));
        }
    }
}
