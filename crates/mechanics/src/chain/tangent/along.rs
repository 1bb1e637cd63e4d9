//! Coefficients of the variational equations: stiffnesses, dashpots and forcing along a motion.

use std::{borrow::Cow, ops::Range};

use chainwave_measurement::Trajectory;
use pulp::Simd;

use super::super::change::{Change, ChangedPart, DerivativeRequest};
use crate::equations::{
    force_row::ForceRow,
    ground::Ground,
    model::{ChainModel, PhasePoint},
    parameters::Chain,
    row::RowEnd,
    state::{ChainState, row_length},
};
use crate::{
    contact::{spring::Spring, striker::StrikerContact},
    lanes::padded,
};

/// What stands along a motion, between its samples its Hermite interpolant, and what changes of the chain do to the accelerations there.
pub(super) struct Along<'a> {
    model: &'a ChainModel<'a>,
    /// The spring of each gap of the row.
    springs: Vec<Cow<'a, Spring>>,
    sides: Vec<ChangedModels<'a>>,
    /// The motion at one time, and its springs' forces.
    state: ChainState,
    springs_n: ForceRow,
    /// Rows for the two sides of a change.
    force_n: ForceRow,
    accelerations: [Vec<f64>; 2],
    /// What a change adds to the masses' accelerations.
    added: Vec<f64>,
}

/// A chain on both sides of a change.
struct ChangedModels<'a> {
    below: ChainModel<'a>,
    above: ChainModel<'a>,
    width: f64,
    seat: ChangedPart,
    /// Masses up to the last one whose acceleration it changes, up to whole vectors.
    reach: usize,
    /// Masses whose acceleration it changes, and nothing where these rest between neighbours that do.
    felt: Range<usize>,
}

/// How a striker's contact closes.
pub(super) struct Closing {
    /// Its gap of the row.
    pub(super) gap: usize,
    /// The force that sets in.
    pub(super) push_n: f64,
    /// The rate of closing.
    pub(super) closing_m_per_s: f64,
}

/// What the variational equations hold at one time.
#[derive(Debug, Clone)]
pub(super) struct Coefficients {
    /// Tangent stiffness and dashpot of the gap behind each mass.
    pub(super) k_n_per_m: Vec<f64>,
    pub(super) c_kg_per_s: Vec<f64>,
    /// Stiffness of what holds each mass to ground; empty where nothing does.
    pub(super) ground_n_per_m: Vec<f64>,
    /// Velocity of each mass.
    pub(super) v_m_per_s: Vec<f64>,
    /// What each change adds to the acceleration of each mass, mass after mass.
    pub(super) forcing: Vec<f64>,
    /// Derivatives of displacement and velocity that an imposed motion gives mass 0, change after change.
    imposed: Option<[Vec<f64>; 2]>,
}

impl Coefficients {
    /// Sets what is imposed in rows of derivatives of displacement and velocity.
    #[inline(always)]
    pub(super) fn impose(&self, s: &mut [f64], u: &mut [f64]) {
        if let Some([s_0, u_0]) = &self.imposed {
            s[..s_0.len()].copy_from_slice(s_0);
            u[..u_0.len()].copy_from_slice(u_0);
        }
    }
}

impl<'a> Along<'a> {
    pub(super) fn new(chain: &Chain, model: &'a ChainModel<'a>, asked: DerivativeRequest<'a>) -> Self {
        let n = model.n_masses();
        Self {
            model,
            springs: (0..n).map(|gap| model.spring(gap)).collect(),
            sides: asked.changes.iter().map(ChangedModels::new).collect(),
            state: model.initial_state(chain),
            springs_n: ForceRow::new(n),
            force_n: ForceRow::new(n),
            accelerations: [vec![0.0; row_length(n)], vec![0.0; row_length(n)]],
            added: vec![0.0; row_length(n)],
        }
    }

    /// Room for the coefficients, the changes padded to `n_lanes`.
    pub(super) fn coefficients(&self, n_lanes: usize) -> Coefficients {
        let n = self.model.n_masses();
        Coefficients {
            k_n_per_m: vec![0.0; n],
            c_kg_per_s: vec![0.0; n],
            ground_n_per_m: vec![0.0; if self.model.ground.is_some() { n } else { 0 }],
            v_m_per_s: vec![0.0; n],
            forcing: vec![0.0; (n + 1) * n_lanes],
            imposed: self.model.is_imposed().then(|| [vec![0.0; n_lanes], vec![0.0; n_lanes]]),
        }
    }

    /// Derivatives of displacement and velocity of each mass at t = 0, change after change.
    pub(super) fn changes_at_start(&self, changes: &[Change]) -> Vec<Vec<[f64; 2]>> {
        let of_change = |(change, sides): (&Change, &ChangedModels<'_>)| {
            let below = sides.below.initial_state(&change.below);
            let above = sides.above.initial_state(&change.above);
            let of_mass = |mass: usize| {
                [above.x_m[mass] - below.x_m[mass], above.v_m_per_s[mass] - below.v_m_per_s[mass]]
                    .map(|difference| difference / sides.width)
            };
            (0..self.model.n_masses()).map(of_mass).collect()
        };
        changes.iter().zip(&self.sides).map(of_change).collect()
    }

    /// Whether all masses still rest, at a sample of the motion, that feel a change, and their neighbours.
    pub(super) fn rests(&self, motion: &Trajectory, sample: usize) -> bool {
        let rows = [&motion.displacement_m, &motion.velocity_m_per_s];
        let rests = |mass: usize| rows.iter().all(|row| row[(mass, sample)] == 0.0);
        let around =
            |felt: &Range<usize>| felt.start.saturating_sub(1)..(felt.end + 1).min(self.model.n_masses());
        self.sides.iter().all(|sides| around(&sides.felt).all(rests))
    }

    /// Whether a mass does not rest at t = 0.
    pub(super) fn moves_at_start(&self, mass: usize) -> bool {
        self.state.x_m[mass] != 0.0 || self.state.v_m_per_s[mass] != 0.0
    }

    /// Takes no masses behind the first so many into account, which rest, up to whole vectors.
    pub(super) fn reach(&mut self, n_masses: usize) {
        self.state.active = padded(n_masses);
    }

    /// Opens or closes the contact of an end's striker; says how, where it closes.
    pub(super) fn switch(&mut self, motion: &Trajectory, end: RowEnd, time_s: f64) -> Option<Closing> {
        let touching = &mut self.state.touching[end.index()];
        *touching = !*touching;
        let closes = *touching;
        self.place(motion, time_s);
        let contact = self.model.strikers[end.index()].as_ref().filter(|_| closes)?;
        let at = self.state.gap(contact.gap);
        let (push_n, closing_m_per_s) = (contact.push_n(at), at.closing_m_per_s);
        (closing_m_per_s > 0.0).then_some(Closing { gap: contact.gap, push_n, closing_m_per_s })
    }

    /// Works out the coefficients at a time.
    #[inline(always)]
    pub(super) fn work_out<S: Simd>(
        &mut self,
        simd: S,
        motion: &Trajectory,
        time_s: f64,
        coefficients: &mut Coefficients,
    ) {
        self.place(motion, time_s);
        let Coefficients { k_n_per_m, c_kg_per_s, ground_n_per_m, forcing, imposed, v_m_per_s } =
            coefficients;
        let ChainState { x_m, touching, active, .. } = &self.state;
        self.model.gap_forces(simd, x_m, *touching, *active, &mut self.springs_n);
        let springs_n = self.springs_n.behind(*active);
        let gaps = k_n_per_m.iter_mut().zip(&self.springs).take(*active);
        for (gap, (k, spring)) in gaps.enumerate() {
            *k = spring.stiffness_n_per_m(x_m[gap] - x_m[gap + 1], springs_n[gap]);
        }
        for (mass, ground) in ground_n_per_m.iter_mut().enumerate().take(*active) {
            *ground = self.model.ground_n_per_m(mass, x_m[mass]);
        }
        self.model.end(*touching, k_n_per_m);
        self.model.dashpots(self.state.place(), c_kg_per_s);
        let n_masses = self.model.n_masses();
        let n_lanes = forcing.len() / (n_masses + 1);
        for lane in 0..self.sides.len() {
            if self.sides[lane].seat == ChangedPart::Drive {
                continue;
            }
            self.accelerate(simd, lane);
            let ChangedModels { width, reach, .. } = self.sides[lane];
            let reach = reach.min(self.state.active);
            let added = &mut self.added[..reach];
            slope(simd, self.accelerations.each_ref().map(|row| &row[..reach]), width, added);
            let of_masses = forcing[lane..].iter_mut().step_by(n_lanes).take(n_masses);
            of_masses.zip(added).for_each(|(place, added)| *place = *added);
        }
        v_m_per_s.iter_mut().zip(self.state.v_m_per_s.iter()).for_each(|(to, from)| *to = *from);
        if let Some([s, u]) = imposed {
            for (sides, (s, u)) in self.sides.iter().zip(s.iter_mut().zip(u)) {
                (*s, *u) = sides.imposed(time_s);
            }
        }
    }

    /// Puts the masses where the motion has them at a time.
    fn place(&mut self, motion: &Trajectory, time_s: f64) {
        let last_s = motion.times_s.last().copied().unwrap_or(0.0);
        if let Some(moment) = motion.at(time_s.min(last_s)) {
            let ChainState { x_m, v_m_per_s, active, .. } = &mut self.state;
            moment.fill(&mut x_m[..*active], &mut v_m_per_s[..*active]);
        }
    }

    /// Accelerations of the masses below and above a change.
    #[inline(always)]
    fn accelerate<S: Simd>(&mut self, simd: S, change: usize) {
        let Self { state, springs_n, force_n, .. } = self;
        let sides = &self.sides[change];
        let place = PhasePoint { active: sides.reach.min(state.active), ..state.place() };
        for (model, acceleration) in [&sides.below, &sides.above].into_iter().zip(&mut self.accelerations) {
            match sides.seat {
                ChangedPart::Contacts => model.rates(simd, place, force_n, acceleration),
                ChangedPart::MassesAndDampers | ChangedPart::Drive => {
                    force_n.copy_from(springs_n, place.active);
                    model.rates_by_springs(simd, place, force_n, acceleration)
                }
            };
        }
    }
}

impl<'a> ChangedModels<'a> {
    fn new(change: &'a Change) -> Self {
        let [below, above] = [&change.below, &change.above].map(ChainModel::new);
        let seat = change.seat();
        let n_masses = below.n_masses();
        let felt = match seat {
            ChangedPart::MassesAndDampers | ChangedPart::Contacts => felt(&below, &above),
            ChangedPart::Drive => 0..n_masses,
        };
        let reach = match seat {
            ChangedPart::MassesAndDampers => padded(felt.end),
            ChangedPart::Contacts | ChangedPart::Drive => padded(n_masses),
        };
        Self { below, above, width: change.width, seat, reach, felt }
    }

    /// Derivatives of displacement and velocity that are imposed on mass 0.
    fn imposed(&self, time_s: f64) -> (f64, f64) {
        let [below, above] = [&self.below, &self.above].map(|model| {
            let (mut x_m, mut v_m_per_s) = ([0.0], [0.0]);
            model.impose(time_s, &mut x_m, &mut v_m_per_s);
            (x_m[0], v_m_per_s[0])
        });
        ((above.0 - below.0) / self.width, (above.1 - below.1) / self.width)
    }
}

/// Masses from the first to the last one whose acceleration differs between two chains; all of them where a curve holds them to ground.
fn felt(below: &ChainModel<'_>, above: &ChainModel<'_>) -> Range<usize> {
    let n_masses = below.n_masses();
    if [below, above].iter().any(|model| model.ground.as_ref().is_some_and(Ground::is_curved)) {
        return 0..n_masses;
    }
    let differs = |mass: &usize| {
        let felt = |model: &ChainModel<'_>| {
            let spring = model.ground.as_ref().map_or(0.0, |ground| ground.springs_n_per_m()[*mass]);
            [model.inverse_mass_per_kg[*mass], model.damping_kg_per_s[*mass], spring].map(f64::to_bits)
        };
        felt(below) != felt(above)
    };
    let strikers = below.strikers.iter().flatten().zip(above.strikers.iter().flatten());
    let damped = |contact: &StrikerContact| contact.damping_kg_per_s.to_bits();
    let dashpots = strikers.filter(|(below, above)| damped(below) != damped(above));
    let contacts = (0..n_masses).filter(|gap| below.contact(*gap) != above.contact(*gap));
    let beside = dashpots.map(|(below, _)| below.gap).chain(contacts).flat_map(|gap| [gap, gap + 1]);
    let masses: Vec<usize> = (0..n_masses).filter(differs).chain(beside).collect();
    let (first, last) = (masses.iter().min().copied(), masses.iter().max().copied());
    first.unwrap_or(0)..last.map_or(1, |last| (last + 1).min(n_masses))
}

/// What grows from the first row to the second over a width.
#[inline(always)]
fn slope<S: Simd>(simd: S, [low, high]: [&[f64]; 2], width: f64, out: &mut [f64]) {
    let width = simd.splat_f64s(width);
    let sides = S::as_simd_f64s(low).0.iter().zip(S::as_simd_f64s(high).0);
    for (out, (low, high)) in S::as_mut_simd_f64s(out).0.iter_mut().zip(sides) {
        *out = simd.div_f64s(simd.sub_f64s(*high, *low), width);
    }
}
