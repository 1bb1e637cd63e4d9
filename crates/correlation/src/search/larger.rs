//! Subsets twice as large, which are asked where noise leaves too little of the usual ones.

/// Factor by which a subset is larger that is looked at where noise leaves too little of a usual one.
///
/// A speckle of width s is shown a distance d r from where a template expects it that is off by an angle or a stretch of d. The template
/// stands out of noise the most with a reach of about 1.6 s/d: twice the reach with half the step tells twice as much.
pub(crate) const LARGER: f64 = 2.0;
/// What the place of a point may differ by from that of the larger subset around it.
const SAME_PX: f64 = 1.0;

/// Whether a larger subset around a point puts it where it was found.
pub(crate) fn is_same_place(found_px: [f64; 2], around_px: [f64; 2]) -> bool {
    (around_px[0] - found_px[0]).hypot(around_px[1] - found_px[1]) <= SAME_PX
}
