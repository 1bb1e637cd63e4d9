//! Whether a match in a frame of a film is to be believed: by what chance gives on its texture, by where the texture repeats itself, by how
//! the subset fared before, and where that does not settle it, by what else the frame shows around it.
//!
//! What stands clear of chance and of the reference's own repeats, which are looked for once, and has not suddenly fallen below what it was
//! in the frames before, is believed at once. Any other match is held against its rivals: the places around it that resemble the subset
//! most, each matched as it was itself. It is right where it resembles more than chance allows and none of them as much.

mod around;

use std::sync::OnceLock;

use chainwave_measurement::{Lost, Recording, Region};

use crate::acceptance::around::Around;
use crate::middle::is_bare_in_middle;
use crate::search::area::{Found, SearchArea};
use crate::search::chance::{
    RARE, chance_zncc, chance_zncc_over, correlation_length_px, expected_zncc, fisher, ways_to_leave_out,
};
use crate::search::light::{Light, chance_in_light};
use crate::search::patch::Patch;
use crate::search::rivals::{Own, PlaceMatch, RIVAL_SHARE, best_rival};
use crate::search::template::Template;
use crate::search::{area_around, region_around};
use crate::warp::Warp;
use crate::window::can_sample;
use crate::{Acceptance, PreparedSubset, ReferenceFrames, Window, Workspace, mean_of_frames};

/// Share of matches of something else, at a place where the subset was expected, that may be taken for it: what is expected need not be as
/// improbable by chance as what is searched for.
const RARE_WHERE_EXPECTED: f64 = 1e-6;
/// Places among which an iteration chooses by itself.
const N_NEAR: f64 = 8.0;
/// Standard errors by which noise may change the difference of two correlations, of which each has the variance 1 over the pixels after
/// Fisher's transform.
const BEYOND_NOISE: f64 = 5.5;
/// Numbers that a match counts as fitted at least where a search chose how it is deformed, or that it is not: those of an affine one.
const N_DEFORMED: usize = 6;
/// Rivals that are matched.
const N_RIVALS: usize = 3;
/// Places of the reference, the most alike first, that a subset which is searched for may be mistaken for.
const MOST_TWINS: usize = 64;
/// Distance of the pixels next to one.
const NEXT_PX: f64 = 1.5;
/// Correlation of a subset that shows no more of itself than of something else.
const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Share of the usual correlation, after Fisher's transform, below which it has fallen suddenly.
const SUDDEN: f64 = 0.6;
/// The same of a match that a search gave, below which it is not believed.
const SEARCHED_SHARE: f64 = 0.5;
/// Frames that the usual correlation is a mean of.
const USUAL_FRAMES: f64 = 8.0;
/// Share of the correlation length by which starts beside a match are off.
const BESIDE: f64 = 0.5;
/// Angles in radians by which they are turned.
const BESIDE_RAD: [f64; 4] = [0.2, -0.2, 0.45, -0.45];
/// Share of the correlation length by which a deformation may move the rim of a subset, or a step its middle, and change nothing that its texture tells: its correlation with itself
/// falls by two per cent (a Gaussian speckle, exp(-d^2 / 2 s^2) with 2 sqrt(pi) s for that length, over a rectangle).
const UNCHANGED_SHARE: f64 = 0.1;
/// Matches closer than this are the same.
const APART_PX: f64 = 0.5;
/// Largest part of a gradient under which the subset is searched for as it is.
const NEARLY_UPRIGHT: f64 = 0.03;

/// Whether a match of a subset is beyond chance at once, even with a correlation that has fallen as far as is not yet called sudden.
pub(crate) fn is_beyond_doubt(subset: &PreparedSubset) -> bool {
    SUDDEN * fisher(expected_zncc(subset)) >= fisher(chance_zncc(subset, N_NEAR, RARE))
}

/// Whether a correlation is by far less than is usual, after Fisher's transform.
pub(crate) fn has_fallen(zncc: f64, usual: f64) -> bool {
    fisher(zncc) < SUDDEN * usual
}

/// Whether a match of a subset whose neighbours are believed is none, though it agrees with them: its correlation is by far less than theirs
/// (their mean, after Fisher's transform) and than noise leaves of its own, and no more than chance gives or most of it is something else.
pub(crate) fn is_out_of_place(subset: &PreparedSubset, zncc: f64, neighbours: f64) -> bool {
    let usual = neighbours.min(fisher(expected_zncc(subset)));
    has_fallen(zncc, usual) && zncc < chance_zncc(subset, N_NEAR, RARE_WHERE_EXPECTED).max(HALF)
}

/// How a match was come by.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Origin {
    /// From where, and how deformed, the frames before led to expect it.
    Expected(Warp),
    /// As the best of so many places and deformations, of a subset that may be as it was last, or as it would have gone on since.
    Searched { n_trials: usize, reach_px: usize, may_be: [Warp; 2] },
}

/// A place that resembles a subset in its own reference.
#[derive(Debug, Clone, Copy)]
struct Alike {
    /// Where it lies from the subset.
    offset_px: [f64; 2],
    /// How well, after Fisher's transform.
    z: f64,
}

/// How a reference resembles a subset elsewhere.
#[derive(Debug, Default)]
struct Repeats {
    /// The best correlation, after Fisher's transform.
    best: f64,
    period_px: Option<f64>,
    alike: Vec<Alike>,
}

/// What the matches of one subset are held against.
pub(crate) struct Standard {
    acceptance: Acceptance,
    /// Correlation that nothing else has where the subset is expected.
    clear_zncc: f64,
    /// How well the reference resembles the subset elsewhere, after Fisher's transform.
    repeats: f64,
    /// Distance of the nearest place where it does at all.
    period_px: Option<f64>,
    /// The places where it does.
    alike: Vec<Alike>,
    /// The places anywhere in the reference where it does, once a search asks for them.
    twins: OnceLock<Vec<Alike>>,
    /// The frames of the reference.
    frames: ReferenceFrames,
    around: Around,
    /// What noise may change a difference of correlations by.
    noise: f64,
    own_px: f64,
    /// Whether the point itself lies on bare ground.
    is_bare: bool,
    patch: Patch,
    /// Mean light of the last matches, or that of the reference.
    light: Light,
    /// Mean correlation of the last matches, after Fisher's transform, and how many they were.
    usual: (f64, f64),
}

impl Standard {
    /// The standard for a subset of reference frames.
    pub(crate) fn new(recording: &dyn Recording, frames: &ReferenceFrames, subset: &PreparedSubset) -> Self {
        let mut standard = Self {
            acceptance: subset.settings.acceptance,
            clear_zncc: chance_zncc(subset, N_NEAR, RARE),
            repeats: 0.0,
            period_px: None,
            alike: Vec::new(),
            twins: OnceLock::new(),
            frames: frames.clone(),
            around: Around::default(),
            noise: BEYOND_NOISE * (2.0 / subset.n_used as f64).sqrt(),
            own_px: correlation_length_px(subset),
            is_bare: is_bare_in_middle(subset),
            patch: Patch::of(subset),
            light: Light::of(subset),
            usual: (0.0, 0.0),
        };
        if standard.acceptance == Acceptance::ByEvidence {
            let reach_px = subset.settings.search_radius_px;
            let repeats = standard.repeats_in(recording, subset, reach_px, usize::MAX).unwrap_or_default();
            standard.repeats = repeats.best;
            standard.period_px = repeats.period_px;
            standard.alike = repeats.alike;
        }
        standard
    }

    /// The standard for the same subset when it is followed anew.
    pub(crate) fn restart(&mut self, subset: &PreparedSubset) {
        self.usual = (0.0, 0.0);
        self.light = Light::of(subset);
    }

    /// Distance, in pixels, of the nearest place that resembles the subset in its own reference; none where nothing does.
    pub(crate) fn period_px(&self) -> Option<f64> {
        self.period_px
    }

    /// Whether a match where the subset was expected resembles it more than chance does.
    pub(crate) fn is_no_chance(&self, subset: &PreparedSubset, zncc: f64) -> bool {
        zncc >= chance_zncc(subset, N_NEAR, RARE_WHERE_EXPECTED)
    }

    /// The pixels of the subset, to be searched for.
    pub(crate) fn patch(&self) -> &Patch {
        &self.patch
    }

    /// How the places so far around the subset resemble it, at most so many of them.
    fn repeats_in(
        &self,
        recording: &dyn Recording,
        subset: &PreparedSubset,
        reach_px: usize,
        at_most: usize,
    ) -> Option<Repeats> {
        let region = region_around(recording, subset, subset.centre_px, reach_px)?;
        let pixels = mean_of_frames(recording, region, self.frames.range()).ok()?;
        let window = Window::new(region, &pixels, subset.settings.interpolation).ok()?;
        let area = SearchArea::new(region, pixels, subset.mean as f32);
        let mut workspace = Workspace::default();
        let own_px = subset.centre_px;
        let apart_px = |peak: &Found| (peak.place_px[0] - own_px[0]).hypot(peak.place_px[1] - own_px[1]);
        let all = area.peaks_elsewhere(&Template::upright(subset), own_px, NEXT_PX, at_most);
        let alike = all.iter().filter(|peak| peak.zncc >= RIVAL_SHARE);
        let period_px = alike.map(apart_px).min_by(f64::total_cmp);
        let mut peaks = all;
        peaks.retain(|peak| apart_px(peak) > self.own_px);
        let mut between_pixels = |place_px| {
            let found = subset.solve(&window, Warp::at(place_px), &mut workspace).ok()?;
            Some(found.place())
        };
        let own = Own { place_px: own_px, zncc: 1.0, length_px: self.own_px };
        let of_peak = |peak: &Found| best_rival(own, std::slice::from_ref(peak), &mut between_pixels);
        let of_peaks: Vec<f64> = peaks.iter().map(of_peak).collect();
        let alike = peaks.iter().zip(&of_peaks).filter_map(|(peak, &z)| {
            let offset_px = [peak.place_px[0] - own_px[0], peak.place_px[1] - own_px[1]];
            (z > 0.0).then_some(Alike { offset_px, z })
        });
        let alike: Vec<Alike> = alike.collect();
        let best = of_peaks.iter().take(N_RIVALS).copied().fold(0.0, f64::max);
        Some(Repeats { best, period_px, alike })
    }

    /// Whether a match that was searched for may be one of the places that the reference shows to be alike, while the frame does not show the
    /// one where the subset then is: it stands at the frame's rim or beyond, where nothing is held against the match.
    fn may_stand_beyond(
        &self,
        recording: &dyn Recording,
        subset: &PreparedSubset,
        found: PlaceMatch,
    ) -> bool {
        let frame = Region::whole(recording.info().width_px, recording.info().height_px);
        let flat = Warp { curvature: [0.0; 6], ..found.warp };
        let of_found = fisher(found.zncc);
        // As near the rim as interpolation reaches beyond it a rival is held against the match on whole pixels alone, which takes from it.
        let is_hidden = |position_px: [f64; 2]| {
            let corners = subset.bounds(&Warp { position_px, ..flat });
            corners.into_iter().any(|corner| !can_sample(frame, subset.settings.interpolation, corner))
        };
        let [x, y] = found.warp.position_px;
        self.alike.iter().filter(|alike| of_found < alike.z + self.noise).any(|alike| {
            let [u, v] = alike.offset_px;
            // What was found turned may be turned, or be a pattern that is alike when it is turned.
            is_hidden(flat.apply([-u, -v])) || is_hidden([x - u, y - v])
        })
    }

    /// Whether a match that was searched for may be something else that the reference shows to be alike, anywhere in it, while the subset itself
    /// is hidden: it lies nearer to where that would be, had it moved as the subset did, than to where the subset may be.
    fn may_be_a_twin(
        &self,
        recording: &dyn Recording,
        subset: &PreparedSubset,
        found: PlaceMatch,
        may_be: [Warp; 2],
    ) -> bool {
        let info = recording.info();
        let twins = self.twins.get_or_init(|| {
            let reach_px = info.width_px.max(info.height_px);
            self.repeats_in(recording, subset, reach_px, MOST_TWINS).unwrap_or_default().alike
        });
        let of_found = fisher(found.zncc);
        let [x, y] = found.warp.position_px;
        let away_px = |[u, v]: [f64; 2]| {
            let away = |Warp { position_px: [x_0, y_0], .. }: &Warp| (x - x_0 - u).hypot(y - y_0 - v);
            may_be.iter().map(away).fold(f64::INFINITY, f64::min)
        };
        let is_as_alike = |twin: &&Alike| of_found < twin.z + self.noise;
        twins.iter().filter(is_as_alike).any(|twin| away_px(twin.offset_px) < away_px([0.0; 2]))
    }

    /// Why the subset is lost that is not found for a reason: what resembles it too little, of a point on bare ground, says that nothing is to
    /// be seen there, unless it was seen in another frame.
    pub(crate) fn reason(&self, reason: Lost) -> Lost {
        match reason {
            Lost::LowCorrelation | Lost::NotConverged if self.is_bare && !self.was_seen() => Lost::NoTexture,
            other => other,
        }
    }

    /// Whether a match was believed in a frame that is not all of the reference.
    fn was_seen(&self) -> bool {
        self.usual.1 > 0.0
    }

    /// Whether a correlation has suddenly fallen below what it was in the frames before.
    pub(crate) fn has_fallen(&self, zncc: f64) -> bool {
        has_fallen(zncc, self.usual.0)
    }

    /// Whether a match from where the subset was expected is beyond doubt at once.
    pub(crate) fn is_clear(&self, subset: &PreparedSubset, found: &PlaceMatch) -> bool {
        let zncc = found.zncc;
        match self.acceptance {
            Acceptance::Zncc(least) => zncc >= least,
            Acceptance::ByEvidence => {
                let clear_zncc = if found.share_seen < 1.0 {
                    let n_parameters = subset.settings.shape.n_parameters();
                    chance_zncc_over(found.share_seen, n_parameters, subset, N_NEAR, RARE)
                } else {
                    self.clear_zncc
                };
                zncc >= clear_zncc && fisher(zncc) >= self.repeats + self.noise && !self.has_fallen(zncc)
            }
        }
    }

    /// Whether a match that is not beyond doubt is to be believed; `again` matches from another start.
    ///
    /// # Errors
    /// [`Lost::LowCorrelation`] where chance may give as much, [`Lost::NotConverged`] where an iteration from close by ends in a better match
    /// close by, [`Lost::Ambiguous`] where another place resembles the subset as well, or may do so beyond the frame's rim, or did so in the
    /// reference and may be what was found.
    pub(crate) fn verify(
        &self,
        recording: &dyn Recording,
        frame: usize,
        subset: &PreparedSubset,
        found: PlaceMatch,
        origin: Origin,
        again: impl FnMut(Warp) -> Option<PlaceMatch>,
    ) -> Result<(), Lost> {
        let of_shape = subset.settings.shape.n_parameters();
        let (n_parameters, n_trials, p, reach_px) = match (self.acceptance, origin) {
            (Acceptance::Zncc(least), _) => {
                return if found.zncc >= least { Ok(()) } else { Err(Lost::LowCorrelation) };
            }
            (_, Origin::Expected(_)) => {
                (of_shape, N_NEAR, RARE_WHERE_EXPECTED, subset.settings.search_radius_px)
            }
            (_, Origin::Searched { n_trials, reach_px, .. }) => {
                (of_shape.max(N_DEFORMED), n_trials as f64, RARE, reach_px)
            }
        };
        let by_chance = self.by_chance(subset, &found, origin, (n_parameters, n_trials, p));
        let is_told = found.zncc >= by_chance
            || !found.zncc.is_nan()
                && self.around.tells(
                    (recording, &self.frames),
                    frame,
                    subset,
                    &found,
                    (n_parameters, n_trials, p),
                );
        if !is_told {
            return Err(Lost::LowCorrelation);
        }
        // Where it is not expected, what resembles the subset much less than the subset did itself is more likely a part of something else than
        // a subset that changed while it was out of sight.
        if let Origin::Searched { may_be, .. } = origin {
            if fisher(found.zncc) < SEARCHED_SHARE * self.usual.0 {
                return Err(Lost::LowCorrelation);
            }
            if self.may_stand_beyond(recording, subset, found)
                || self.may_be_a_twin(recording, subset, found, may_be)
            {
                return Err(Lost::Ambiguous);
            }
        }
        let mut again = again;
        if self.is_beside_a_better_one(found, &mut again) {
            return Err(Lost::NotConverged);
        }
        let place_px = found.warp.position_px;
        let area = area_around(recording, frame, subset, place_px, reach_px).map_err(|_| Lost::Unreadable)?;
        let Some(area) = area else { return Ok(()) };
        let deformed = found.warp.gradient.iter().any(|slope| slope.abs() > NEARLY_UPRIGHT);
        let of_warp = if deformed { self.patch.template(&found.warp) } else { None };
        let template = of_warp.unwrap_or_else(|| Template::upright(subset));
        let peaks = area.peaks_elsewhere(&template, place_px, self.own_px, N_RIVALS);
        let own = Own { place_px, zncc: found.zncc, length_px: self.own_px };
        let best = best_rival(own, &peaks, |place_px| again(Warp { position_px: place_px, ..found.warp }));
        if fisher(found.zncc) < best + self.noise { Err(Lost::Ambiguous) } else { Ok(()) }
    }

    /// The correlation that something else has with the subset in a share `p` of cases, at the best of so many places and deformations, with so many
    /// parameters fitted: those that came out as was expected are none of them, and what was left out was chosen.
    fn by_chance(
        &self,
        subset: &PreparedSubset,
        found: &PlaceMatch,
        origin: Origin,
        (n_parameters, n_trials, p): (usize, f64, f64),
    ) -> f64 {
        match origin {
            Origin::Expected(start) if self.is_deformed_as(subset, &start, &found.warp) => {
                let (n_parameters, n_trials) =
                    if self.is_placed_as(&start, &found.warp) { (0, 1.0) } else { (2, n_trials) };
                let in_light = |light| {
                    n_trials * chance_in_light(subset, n_parameters, found.zncc, [self.light, light]) < p
                };
                let is_in_light = found.light.is_some_and(in_light);
                if is_in_light {
                    0.0
                } else {
                    chance_zncc_over(found.share_seen, n_parameters, subset, n_trials, p)
                }
            }
            Origin::Searched { may_be: [last, _], .. } => {
                let n_trials = ways_to_leave_out(subset, found.share_seen) * n_trials;
                // What was found as little deformed as it was last was not made to resemble it by deforming it, if it could have been.
                let can_deform = subset.settings.shape.n_parameters() >= N_DEFORMED;
                match can_deform && self.is_deformed_as(subset, &last, &found.warp) {
                    true => chance_zncc_over(found.share_seen, 2, subset, n_trials, p),
                    false => chance_zncc_over(found.share_compared(), n_parameters, subset, n_trials, p),
                }
            }
            Origin::Expected(_) => {
                chance_zncc_over(found.share_compared(), n_parameters, subset, n_trials, p)
            }
        }
    }

    /// Whether a subset lies and is deformed so nearly as was expected that its texture would hardly tell.
    pub(crate) fn is_as_expected(&self, subset: &PreparedSubset, expected: &Warp, found: &Warp) -> bool {
        self.is_placed_as(expected, found) && self.is_deformed_as(subset, expected, found)
    }

    /// Whether a subset lies so near to where it was expected that its texture would hardly tell.
    fn is_placed_as(&self, expected: &Warp, found: &Warp) -> bool {
        let [x, y] = [0, 1].map(|axis| found.position_px[axis] - expected.position_px[axis]);
        x.hypot(y) < UNCHANGED_SHARE * self.own_px
    }

    /// Whether a subset is deformed so nearly as was expected that its texture would hardly tell: nothing was made to resemble it by deforming it.
    fn is_deformed_as(&self, subset: &PreparedSubset, expected: &Warp, found: &Warp) -> bool {
        let half_px = subset.half_px();
        let reaches_px = [half_px[0], half_px[1], half_px[0], half_px[1]];
        let moved_px = |k: usize| (found.gradient[k] - expected.gradient[k]).abs() * reaches_px[k];
        let bent_px = |curvature: &f64| curvature.abs() * half_px[0].max(half_px[1]).powi(2);
        let largest_px = (0..4).map(moved_px).chain(found.curvature.iter().map(bent_px)).fold(0.0, f64::max);
        largest_px < UNCHANGED_SHARE * self.own_px
    }

    /// Whether iterations from starts around a match, a little off or turned, settle in another place with a better correlation.
    /// A texture that is turned or stretched holds the iteration in side maxima within its own correlation length, which resemble it more
    /// than chance does.
    fn is_beside_a_better_one(
        &self,
        found: PlaceMatch,
        again: &mut impl FnMut(Warp) -> Option<PlaceMatch>,
    ) -> bool {
        let [x, y] = found.warp.position_px;
        let away_px = BESIDE * self.own_px;
        let moved = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]
            .map(|[u, v]| Warp { position_px: [x + away_px * u, y + away_px * v], ..found.warp });
        let turned = BESIDE_RAD.map(|angle_rad| found.warp.turned(angle_rad));
        moved.into_iter().chain(turned).filter_map(again).any(|other| {
            let [u, v] = other.warp.position_px;
            (u - x).hypot(v - y) > APART_PX && fisher(other.zncc) > fisher(found.zncc) + self.noise
        })
    }

    /// Notes a match that was believed.
    pub(crate) fn note(&mut self, found: &PlaceMatch) {
        let (mean, n) = self.usual;
        let n = (n + 1.0).min(USUAL_FRAMES);
        self.usual = (mean + (fisher(found.zncc) - mean) / n, n);
        if let Some(light) = found.light {
            self.light = self.light.averaged(light, n);
        }
    }
}
