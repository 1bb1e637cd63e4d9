use pulp::Simd;

use super::{Rod, lanes::Lanes, rod::BULGE};

/// Largest sine whose arc the polynomial gives: changes of turn up to 30 degrees without, and 120 with their quartering.
const LARGEST_SINE: f64 = 0.5;
/// Largest change of a chord's squared length, relative to it, for which the series of its root stands.
const LARGEST_STRETCH: f64 = 0.01;
/// (asin(s) - s) / s^3 as a polynomial in s^2, lowest power first: relative error of the arc 6.2e-11 up to
/// [`LARGEST_SINE`] (interpolated at Chebyshev's nodes).
const ARC: [f64; 7] = [
    0.166_666_666_860_856_44,
    0.074_999_924_044_018_38,
    0.044_647_663_888_134_85,
    0.030_269_138_728_589_184,
    0.023_611_817_008_891_75,
    0.010_574_415_516_912_908,
    0.030_974_540_371_355_073,
];
/// (1 - 1 / sqrt(1 + e)) / e as a polynomial in e, lowest power first: Taylor's, so that small stretches keep their
/// digits; at [`LARGEST_STRETCH`] the square root's relative error is 3e-11 of the strain's.
const INVERSE_ROOT: [f64; 4] = [0.5, -3.0 / 8.0, 5.0 / 16.0, -35.0 / 128.0];
/// Values kept of each element between the two sweeps.
const KEPT: usize = 6;
/// Values of a node: its displacement and its velocity.
pub(crate) const NODE: usize = 4;

/// A half ring's element loop, for vectors of rings.
///
/// Lengths are in units of one element's, masses of one element's, times of the step; so a velocity is what it moves in a
/// step, and a force what it adds to that. Forces are those that remain after the dampers' share in the step.
#[derive(Debug, Clone)]
pub(crate) struct Kernel {
    elements: Vec<Element>,
    /// The factors of [`super::three_moments::ThreeMoments`], inverse pivots times the bending stiffness.
    lower: Vec<f64>,
    bending_pivots: Vec<f64>,
    axial: f64,
    /// What the dampers leave of a velocity in a step.
    keep: f64,
    /// What they leave of a force.
    gain: f64,
    /// Their rate times the step.
    decay: f64,
}

/// One element of the unstressed half ring.
#[derive(Debug, Clone, Copy)]
struct Element {
    /// Chord over its squared length.
    inverse: [f64; 2],
    /// Chord's direction.
    along: [f64; 2],
    /// Axial stiffness times the chord's length, and times [`BULGE`]: a normal force is these times relative elongation and bulge.
    axial: [f64; 2],
    inverse_length: f64,
    /// Twice the unstressed turn at either node plus the turn at the other.
    turns: [f64; 2],
}

/// Forces and energies of a vector of rings.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Outcome<S: Simd> {
    /// Force along the chain on the left and right joint.
    pub(crate) ends: [Lanes<S>; 2],
    pub(crate) strain_energy: Lanes<S>,
    pub(crate) moved: Moved<S>,
}

/// Sums over inner nodes that moved, where they are asked for; a node's mass is 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moved<S: Simd> {
    /// Half the product of the velocities before and after.
    pub(crate) kinetic_energy: Lanes<S>,
    /// Mean of the momentum along the chain before and after.
    pub(crate) momentum: Lanes<S>,
    /// Half the square of the mean of the velocities before and after.
    pub(crate) mean_squares: Lanes<S>,
}

/// An element's state in the second sweep.
#[derive(Clone, Copy)]
struct Loaded<S: Simd> {
    normal: Lanes<S>,
    inverse_stretch: Lanes<S>,
    cosine: Lanes<S>,
    sine: Lanes<S>,
}

impl Kernel {
    /// The loop for a half ring, a time step in seconds and the rate, in 1/s, at which dampers to ground take momentum.
    pub(crate) fn new(rod: &Rod, dt_s: f64, decay_per_s: f64) -> Self {
        let (section, h) = (rod.section(), rod.arc_m);
        let halved = 0.5 * decay_per_s * dt_s;
        let gain = (1.0 + halved).recip();
        let per_mass = gain * dt_s * dt_s / (section.mass_kg_per_m * h * h);
        let (axial, bending) = (section.axial_n * per_mass, section.bending_nm2 * per_mass / (h * h));
        let element = |(e, chord): (usize, &super::rod::Chord)| {
            let (vector, length) = (chord.vector_m / h, chord.length_m / h);
            let [a, b] = [rod.curvature_turns[e], rod.curvature_turns[e + 1]];
            Element {
                inverse: (vector / (length * length)).into(),
                along: (vector / length).into(),
                axial: [axial * length, axial * BULGE],
                inverse_length: length.recip(),
                turns: [2.0 * a + b, 2.0 * b + a],
            }
        };
        Self {
            elements: rod.chords.iter().enumerate().map(element).collect(),
            lower: rod.three_moments.lower.clone(),
            bending_pivots: rod.three_moments.inverse_pivots.iter().map(|pivot| pivot * bending).collect(),
            axial,
            keep: (1.0 - halved) * gain,
            gain,
            decay: decay_per_s * dt_s,
        }
    }

    /// The dampers' rate times the step.
    pub(crate) fn decay(&self) -> f64 {
        self.decay
    }

    /// What the dampers leave of a velocity in a step.
    pub(crate) fn keep(&self) -> f64 {
        self.keep
    }

    /// What the dampers leave of a force in a step.
    pub(crate) fn gain(&self) -> f64 {
        self.gain
    }

    /// Values that a vector of rings needs between the two sweeps.
    pub(crate) fn scratch_len(&self) -> usize {
        KEPT * self.elements.len()
    }

    /// Finds the forces at the nodes' places, and moves the inner nodes by a step. `nodes` holds x, y and the velocities of
    /// each inner node; `joints` the places of the two joints. `None`, with nothing moved, where a ring is deformed beyond
    /// the polynomials' range, which is that of large deformations where it is to be `WIDE`.
    #[inline(always)]
    pub(crate) fn step<S: Simd, const BOOK: bool, const DAMPED: bool, const WIDE: bool>(
        &self,
        simd: S,
        nodes: &mut [[S::f64s; NODE]],
        joints: [Lanes<S>; 2],
        scratch: &mut [[S::f64s; KEPT]],
    ) -> Option<Outcome<S>> {
        let last_turn = self.deform::<S, WIDE>(simd, nodes, joints, scratch)?;
        Some(self.load_and_move::<S, BOOK, DAMPED>(simd, nodes, scratch, last_turn))
    }

    /// First sweep, from left to right: stretch and rotation of each chord, turn at each node, and the elimination in the
    /// theorem of three moments. Returns the last node's turn and eliminated turn.
    #[inline(always)]
    fn deform<S: Simd, const WIDE: bool>(
        &self,
        simd: S,
        nodes: &[[S::f64s; NODE]],
        joints: [Lanes<S>; 2],
        scratch: &mut [[S::f64s; KEPT]],
    ) -> Option<[Lanes<S>; 2]> {
        let all = |value| Lanes::all(simd, value);
        let (zero, one) = (all(0.0), all(1.0));
        let (mut place, mut rotation) = ([joints[0], zero], [one, zero]);
        let (mut eliminated, mut factor) = (zero, 0.0);
        let (mut largest_sine_square, mut largest_stretch_square) = (zero, zero);
        for (e, (element, kept)) in self.elements.iter().zip(scratch.iter_mut()).enumerate() {
            let next = match nodes.get(e) {
                Some(node) => [Lanes::new(simd, node[0]), Lanes::new(simd, node[1])],
                None => [joints[1], zero],
            };
            let change = [next[0] - place[0], next[1] - place[1]];
            place = next;
            // In the frame of the unstressed chord, over its length, the chord is now (1 + along, sideways).
            let [ax, ay] = Lanes::pair(simd, element.inverse);
            let along = ax.mul_add(change[0], ay * change[1]);
            let sideways = ay.mul_sub_from(change[0], ax * change[1]);
            let stretch = sideways.mul_add(sideways, along.mul_add(along, along + along));
            let (inverse_stretch, elongation) = if WIDE {
                let length = (one + stretch).sqrt();
                (one / length, stretch / (one + length))
            } else {
                let square = stretch * stretch;
                largest_stretch_square = largest_stretch_square.max(square);
                let shortening = stretch * stretch.polynomial_4(square, INVERSE_ROOT);
                (one - shortening, shortening.mul_sub_from(one + stretch, stretch))
            };
            let [cosine, sine] =
                [along.mul_add(inverse_stretch, inverse_stretch), sideways * inverse_stretch];
            let (turn, sine_square) = turn::<S, WIDE>(simd, rotation, [cosine, sine]);
            rotation = [cosine, sine];
            eliminated = all(factor).mul_sub_from(eliminated, turn);
            factor = self.lower[e];
            largest_sine_square = largest_sine_square.max(sine_square);
            *kept = [
                turn.values,
                eliminated.values,
                inverse_stretch.values,
                cosine.values,
                sine.values,
                elongation.values,
            ];
        }
        let (turn, sine_square) = turn::<S, WIDE>(simd, rotation, [one, zero]);
        largest_sine_square = largest_sine_square.max(sine_square);
        // Written so that values that are not numbers do not pass.
        let in_range = largest_sine_square.largest() <= LARGEST_SINE * LARGEST_SINE
            && largest_stretch_square.largest() <= LARGEST_STRETCH * LARGEST_STRETCH;
        let last = [turn, all(factor).mul_sub_from(eliminated, turn)];
        if in_range { Some(last) } else { None }
    }

    /// Second sweep, from right to left: moments, normal and shear forces, and the motion of the nodes.
    #[inline(always)]
    fn load_and_move<S: Simd, const BOOK: bool, const DAMPED: bool>(
        &self,
        simd: S,
        nodes: &mut [[S::f64s; NODE]],
        scratch: &[[S::f64s; KEPT]],
        last_turn: [Lanes<S>; 2],
    ) -> Outcome<S> {
        let all = |value| Lanes::all(simd, value);
        let zero = all(0.0);
        let n = self.elements.len();
        let (compliance, bulge, keep) = (all(self.axial.recip()), all(BULGE), all(self.keep));
        // At a node's right: its bending moment, and twice its turn at an end; the moment with the bulges' part; the
        // element behind it, and the force that it carries.
        let mut bending = last_turn[1] * all(self.bending_pivots[n]);
        let mut turn = last_turn[0];
        let mut moment = bending;
        let mut behind: Option<(Loaded<S>, Lanes<S>)> = None;
        let mut force_behind: Option<[Lanes<S>; 2]> = None;
        let mut right_end = zero;
        let mut strain_energy = zero;
        let mut moved = Moved { kinetic_energy: zero, momentum: zero, mean_squares: zero };
        if BOOK {
            strain_energy = bending * turn;
        }
        turn = turn + turn;
        for e in (0..n).rev() {
            let element = &self.elements[e];
            let kept = &scratch[e];
            let [left_turn, eliminated] = [Lanes::new(simd, kept[0]), Lanes::new(simd, kept[1])];
            let inverse_stretch = Lanes::new(simd, kept[2]);
            let [cosine, sine] = [Lanes::new(simd, kept[3]), Lanes::new(simd, kept[4])];
            let elongation = Lanes::new(simd, kept[5]);
            let left_bending =
                all(self.lower[e]).mul_sub_from(bending, eliminated * all(self.bending_pivots[e]));
            let left = if e == 0 { left_turn + left_turn } else { left_turn };
            let [a, b] = Lanes::pair(simd, element.turns);
            let (sum, right_sum) = (a + left + turn, b + turn);
            let excess = left.mul_add(sum, turn * right_sum);
            let [stretched, bulged] = Lanes::pair(simd, element.axial);
            let normal = bulged.mul_add(excess, elongation * stretched);
            let (left_slope, right_slope) = (sum + left, right_sum + turn + left);
            let normal_bulge = normal * bulge;
            let (left_weight, right_weight) = (
                if e == 0 { normal_bulge + normal_bulge } else { normal_bulge },
                if e + 1 == n { normal_bulge + normal_bulge } else { normal_bulge },
            );
            moment = right_weight.mul_add(right_slope, moment);
            if BOOK {
                strain_energy = strain_energy + left_bending.mul_add(left_turn, normal * normal * compliance);
            }
            if let Some((loaded, right_moment)) = behind {
                let force = self.elements[e + 1].force(simd, loaded, moment - right_moment);
                match force_behind {
                    Some(force_behind) => {
                        let forces = [force, force_behind];
                        moved.push::<BOOK, DAMPED>(simd, keep, &mut nodes[e + 1], forces);
                    }
                    None => right_end = -force[0],
                }
                force_behind = Some(force);
            }
            behind = Some((Loaded { normal, inverse_stretch, cosine, sine }, moment));
            moment = left_weight.mul_add(left_slope, left_bending);
            (bending, turn) = (left_bending, left_turn);
        }
        let mut left_end = zero;
        if let Some((loaded, right_moment)) = behind {
            let force = self.elements[0].force(simd, loaded, moment - right_moment);
            if let Some(force_behind) = force_behind {
                moved.push::<BOOK, DAMPED>(simd, keep, &mut nodes[0], [force, force_behind]);
            }
            left_end = force[0];
        }
        let half = all(0.5);
        Outcome {
            ends: [left_end, right_end],
            strain_energy: strain_energy * half,
            moved: moved.scaled(simd),
        }
    }
}

impl Element {
    /// The force that an element pulls its left node with, from its normal force and the difference of its end moments.
    #[inline(always)]
    fn force<S: Simd>(&self, simd: S, loaded: Loaded<S>, moment: Lanes<S>) -> [Lanes<S>; 2] {
        let Loaded { normal, inverse_stretch, cosine, sine } = loaded;
        let shear = moment * inverse_stretch * Lanes::all(simd, self.inverse_length);
        let along = shear.mul_sub_from(sine, normal * cosine);
        let sideways = shear.mul_add(cosine, normal * sine);
        let [x, y] = Lanes::pair(simd, self.along);
        [y.mul_sub_from(sideways, x * along), y.mul_add(along, x * sideways)]
    }
}

impl<S: Simd> Moved<S> {
    /// Moves a node by a step; the forces pull it to the left and to the right.
    #[inline(always)]
    fn push<const BOOK: bool, const DAMPED: bool>(
        &mut self,
        simd: S,
        keep: Lanes<S>,
        node: &mut [S::f64s; NODE],
        [left, right]: [[Lanes<S>; 2]; 2],
    ) {
        let [x, y] = [Lanes::new(simd, node[0]), Lanes::new(simd, node[1])];
        let [before_x, before_y] = [Lanes::new(simd, node[2]), Lanes::new(simd, node[3])];
        let after_x = before_x.mul_add(keep, right[0] - left[0]);
        let after_y = before_y.mul_add(keep, right[1] - left[1]);
        *node = [(x + after_x).values, (y + after_y).values, after_x.values, after_y.values];
        let (sum_x, sum_y) = (before_x + after_x, before_y + after_y);
        if BOOK {
            self.kinetic_energy = before_x.mul_add(after_x, before_y.mul_add(after_y, self.kinetic_energy));
            self.momentum = self.momentum + sum_x;
        }
        if DAMPED {
            self.mean_squares = sum_x.mul_add(sum_x, sum_y.mul_add(sum_y, self.mean_squares));
        }
    }

    /// The sums with the factors that are the same for all nodes.
    #[inline(always)]
    fn scaled(self, simd: S) -> Self {
        let half = Lanes::all(simd, 0.5);
        Self {
            kinetic_energy: self.kinetic_energy * half,
            momentum: self.momentum * half,
            mean_squares: self.mean_squares * Lanes::all(simd, 0.125),
        }
    }
}

/// The angle from one direction to the next, and the square of the sine that it was found from.
#[inline(always)]
fn turn<S: Simd, const WIDE: bool>(simd: S, from: [Lanes<S>; 2], to: [Lanes<S>; 2]) -> (Lanes<S>, Lanes<S>) {
    let sine = to[0].mul_sub_from(from[1], to[1] * from[0]);
    if !WIDE {
        return arc(sine);
    }
    let (one, two, half) = (Lanes::all(simd, 1.0), Lanes::all(simd, 2.0), Lanes::all(simd, 0.5));
    // sin(phi / 2) = sin(phi) / (2 cos(phi / 2)), twice.
    let cosine = to[0].mul_add(from[0], to[1] * from[1]);
    let half_cosine = ((one + cosine) * half).sqrt();
    let quarter_cosine = ((one + half_cosine) * half).sqrt();
    let (quarter, square) = arc(sine / (half_cosine * quarter_cosine * two * two));
    (quarter * two * two, square)
}

/// The arc of a sine up to [`LARGEST_SINE`], and the sine's square.
#[inline(always)]
fn arc<S: Simd>(sine: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
    let square = sine * sine;
    let excess = square.polynomial_7(square * square, ARC);
    ((square * sine).mul_add(excess, sine), square)
}
