use crate::{Chain, Drive, FarEnd, ImposedMotion, kernel::PowerKernel};

/// The chain as the integrator sees it: masses in a row, the striker first where there is one.
///
/// Gap g lies between masses g - 1 and g of the row; gap 0 is the free side of the first mass, gap `n_masses` lies
/// behind the last one.
#[derive(Debug)]
pub(crate) struct Model<'a> {
    pub(crate) kernel: PowerKernel,
    /// Zero where the motion is imposed, so that the mass neither accelerates nor counts as energy.
    pub(crate) mass_kg: Vec<f64>,
    inverse_mass_per_kg: Vec<f64>,
    damping_kg_per_s: Vec<f64>,
    /// Damping of the striker's contact, where there is a striker.
    striker_damping_kg_per_s: Option<f64>,
    imposed: Option<&'a ImposedMotion>,
    has_wall: bool,
    k_0_n_per_m: f64,
}

/// Where the masses are, how fast they move, and what has gone in or out.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub(crate) x_m: Vec<f64>,
    pub(crate) v_m_per_s: Vec<f64>,
    /// Energy that the dampers took, less the work of an imposed motion.
    pub(crate) lost_j: f64,
    /// Whether the striker's contact is closed.
    pub(crate) touching: bool,
}

/// Time derivatives of a state, and the gap forces behind them.
#[derive(Debug, Clone)]
pub(crate) struct Rates {
    pub(crate) acceleration_m_per_s2: Vec<f64>,
    /// Force of gap g, positive in compression; `n_masses + 1` entries.
    pub(crate) force_n: Vec<f64>,
    pub(crate) lost_w: f64,
}

impl Rates {
    pub(crate) fn new(n_masses: usize) -> Self {
        Self { acceleration_m_per_s2: vec![0.0; n_masses], force_n: vec![0.0; n_masses + 1], lost_w: 0.0 }
    }
}

impl<'a> Model<'a> {
    pub(crate) fn new(chain: &'a Chain) -> Self {
        let (mut mass_kg, mut damping_kg_per_s) = (chain.mass_kg.clone(), chain.damping_kg_per_s.clone());
        let (mut striker_damping_kg_per_s, mut imposed) = (None, None);
        match &chain.drive {
            Drive::Striker(striker) => {
                mass_kg.insert(0, striker.mass_kg);
                damping_kg_per_s.insert(0, 0.0);
                striker_damping_kg_per_s = Some(striker.damping_kg_per_s);
            }
            Drive::Imposed(motion) => {
                (mass_kg[0], damping_kg_per_s[0]) = (0.0, 0.0);
                imposed = Some(motion);
            }
            Drive::Free { .. } => {}
        }
        let inverse_mass_per_kg = mass_kg.iter().map(|&m| if m > 0.0 { m.recip() } else { 0.0 }).collect();
        Self {
            kernel: PowerKernel::new(&chain.contact),
            mass_kg,
            inverse_mass_per_kg,
            damping_kg_per_s,
            striker_damping_kg_per_s,
            imposed,
            has_wall: chain.far_end == FarEnd::Fixed,
            k_0_n_per_m: chain.contact.k_0_n_per_m(),
        }
    }

    /// The state at t = 0; a striker touches.
    pub(crate) fn initial_state(&self, chain: &Chain) -> State {
        let n = self.n_masses();
        let (mut x_m, mut v_m_per_s) = (vec![0.0; n], vec![0.0; n]);
        match &chain.drive {
            Drive::Striker(striker) => v_m_per_s[0] = striker.velocity_m_per_s,
            Drive::Imposed(_) => self.impose(0.0, &mut x_m, &mut v_m_per_s),
            Drive::Free { displacement_m, velocity_m_per_s: velocity } => {
                x_m.copy_from_slice(displacement_m);
                v_m_per_s.copy_from_slice(velocity);
            }
        }
        State { x_m, v_m_per_s, lost_j: 0.0, touching: self.has_striker() }
    }

    /// Bodies, and the striker.
    pub(crate) fn n_masses(&self) -> usize {
        self.mass_kg.len()
    }

    pub(crate) fn has_striker(&self) -> bool {
        self.striker_damping_kg_per_s.is_some()
    }

    /// The row's gap that is gap 1 of the chain.
    pub(crate) fn first_gap(&self) -> usize {
        if self.has_striker() { 2 } else { 1 }
    }

    /// Gaps between bodies.
    pub(crate) fn n_gaps(&self) -> usize {
        self.n_masses() - self.first_gap()
    }

    /// Overlaps, in metres, of the gaps that are not between bodies and carry force: the striker's and the wall's.
    pub(crate) fn outer_overlaps_m(&self, state: &State) -> [Option<f64>; 2] {
        let striker = (self.has_striker() && state.touching).then(|| state.striker_overlap_m());
        [striker, self.has_wall.then(|| state.x_m[self.n_masses() - 1])]
    }

    /// Contact forces that one evaluation of the rates costs.
    pub(crate) fn forces_per_evaluation(&self) -> u64 {
        (self.n_masses() - 1 + usize::from(self.has_wall)) as u64
    }

    /// Sets what is imposed at a time.
    #[inline]
    pub(crate) fn impose(&self, time_s: f64, x_m: &mut [f64], v_m_per_s: &mut [f64]) {
        if let Some(motion) = self.imposed {
            (x_m[0], v_m_per_s[0]) = motion.at(time_s);
        }
    }

    /// Fills `rates` at a state.
    pub(crate) fn rates(&self, state: &State, rates: &mut Rates) {
        let force_n = &mut rates.force_n;
        let first = usize::from(self.has_striker());
        let bonded = state.x_m[first..].windows(2).zip(&mut force_n[first + 1..]);
        for (x, force) in bonded {
            *force = self.kernel.force_n(x[0] - x[1]);
        }
        let n = self.n_masses();
        if self.has_wall {
            force_n[n] = self.kernel.force_n(state.x_m[n - 1]);
        }
        if self.has_striker() {
            force_n[1] = if state.touching { self.kernel.force_n(state.striker_overlap_m()) } else { 0.0 };
        }
        self.finish(state, rates);
    }

    /// Fills `rates` as [`Model::rates`] does, and `energy_j` with the potential energy of each gap.
    pub(crate) fn rates_and_energy(&self, state: &State, rates: &mut Rates, energy_j: &mut [f64]) {
        let force_n = &mut rates.force_n;
        let first = usize::from(self.has_striker());
        let gaps = force_n[first + 1..].iter_mut().zip(&mut energy_j[first + 1..]);
        for (x, (force, energy)) in state.x_m[first..].windows(2).zip(gaps) {
            (*force, *energy) = self.kernel.force_and_energy(x[0] - x[1]);
        }
        let n = self.n_masses();
        if self.has_wall {
            (force_n[n], energy_j[n]) = self.kernel.force_and_energy(state.x_m[n - 1]);
        }
        if self.has_striker() {
            (force_n[1], energy_j[1]) = if state.touching {
                self.kernel.force_and_energy(state.striker_overlap_m())
            } else {
                (0.0, 0.0)
            };
        }
        self.finish(state, rates);
    }

    /// Adds the striker's damping to the gap forces, then turns forces into accelerations and losses.
    fn finish(&self, state: &State, rates: &mut Rates) {
        let v = &state.v_m_per_s;
        let mut lost_w = 0.0;
        if let (Some(damping), true) = (self.striker_damping_kg_per_s, state.touching) {
            let closing = state.striker_closing_m_per_s();
            rates.force_n[1] += damping * closing;
            lost_w += damping * closing * closing;
        }
        if self.imposed.is_some() {
            lost_w -= rates.force_n[1] * v[0];
        }
        let gaps = rates.force_n.windows(2);
        let masses = self.inverse_mass_per_kg.iter().zip(&self.damping_kg_per_s).zip(v);
        for ((acceleration, gap), ((inverse_mass, damping), v)) in
            rates.acceleration_m_per_s2.iter_mut().zip(gaps).zip(masses)
        {
            let drag = damping * v;
            *acceleration = (gap[0] - gap[1] - drag) * inverse_mass;
            lost_w += drag * v;
        }
        rates.lost_w = lost_w;
    }

    /// Positive where the striker's contact should be closed and negative where open, in newtons: the smaller of the
    /// contact force and a linear spring's force at the same overlap. It is continuous, so that its roots are the
    /// switches; a damped contact opens when the dashpot would pull, before the overlap ends.
    pub(crate) fn contact_margin_n(&self, overlap_m: f64, closing_m_per_s: f64) -> f64 {
        let spring_n = self.k_0_n_per_m * overlap_m;
        let damper_n = self.striker_damping_kg_per_s.unwrap_or(0.0) * closing_m_per_s;
        spring_n.min(self.kernel.force_n(overlap_m) + damper_n)
    }

    /// Opens or closes the striker's contact. What its spring holds at that instant leaves with the dashpot that is
    /// let go, or comes back with it; without damping that is zero.
    pub(crate) fn switch_contact(&self, state: &mut State) {
        let stored_j = self.kernel.force_and_energy(state.striker_overlap_m()).1;
        state.lost_j += if state.touching { stored_j } else { -stored_j };
        state.touching = !state.touching;
    }
}

impl State {
    /// Overlap of the striker (mass 0) with body 1, in metres.
    pub(crate) fn striker_overlap_m(&self) -> f64 {
        self.x_m[0] - self.x_m[1]
    }

    /// Rate at which that overlap grows, in metres per second.
    pub(crate) fn striker_closing_m_per_s(&self) -> f64 {
        self.v_m_per_s[0] - self.v_m_per_s[1]
    }
}
