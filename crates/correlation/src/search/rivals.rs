//! Other places that resemble a subset, each matched as it was itself.

use crate::search::area::Found;
use crate::search::chance::fisher;
use crate::search::light::Light;
use crate::warp::Warp;

/// Share of a match's correlation that a rival has between pixels at least.
pub(crate) const RIVAL_SHARE: f64 = 0.5;

/// Where something was matched, and how well.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaceMatch {
    pub(crate) warp: Warp,
    pub(crate) zncc: f64,
    /// Share of the subset's pixels that were matched.
    pub(crate) share_seen: f64,
    /// Its light, where it was matched whole and by what tells that.
    pub(crate) light: Option<Light>,
}

impl PlaceMatch {
    /// Share of the subset's speckles that were compared: a picture that shows it smaller has fewer, one that shows it larger no more.
    pub(crate) fn share_compared(&self) -> f64 {
        self.share_seen * self.warp.area().min(1.0)
    }
}

/// What rivals are held against.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Own {
    pub(crate) place_px: [f64; 2],
    pub(crate) zncc: f64,
    /// Shifts within which the subset resembles itself.
    pub(crate) length_px: f64,
}

/// The best correlation at any of some places and where a match goes from there, unless it goes back to the match itself; after
/// Fisher's transform.
pub(crate) fn best_rival(
    own: Own,
    peaks: &[Found],
    mut again: impl FnMut([f64; 2]) -> Option<PlaceMatch>,
) -> f64 {
    let mut best = 0.0_f64;
    for &Found { place_px, zncc } in peaks {
        if zncc < RIVAL_SHARE * own.zncc {
            continue;
        }
        let rival = again(place_px);
        let [x, y] = rival.map_or(place_px, |rival| rival.warp.position_px);
        if (x - own.place_px[0]).hypot(y - own.place_px[1]) > own.length_px {
            best = best.max(fisher(rival.map_or(zncc, |rival| rival.zncc.max(zncc))));
        }
    }
    best
}
