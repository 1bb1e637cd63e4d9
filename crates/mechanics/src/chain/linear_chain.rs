//! The linear chain that small motions see: its dispersion relation, band edge, speed of sound and critical damping.

use std::f64::consts::{PI, TAU};

use crate::equations::parameters::Chain;

/// An infinite chain of equal masses on equal linear springs, each held to ground by one more where stated: what a chain of contacts is to
/// motions far below delta_0.
///
/// A wave that turns by kappa from body to body has omega^2 = 4 k_0 / m sin^2(kappa / 2) + k_g / m (C. Kittel, Introduction to Solid
/// State Physics, chapter 4; with springs to ground M. Remoissenet, Waves Called Solitons, chapter 2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearChain {
    /// Stiffness k_0 of one gap in newtons per metre.
    pub stiffness_n_per_m: f64,
    /// Mass m of one body in kilograms.
    pub mass_kg: f64,
    /// Stiffness k_g of the spring of a body to ground in newtons per metre; 0 for none.
    pub ground_n_per_m: f64,
}

impl LinearChain {
    /// Frequency in hertz of a wave that turns by `kappa_rad` from body to body.
    pub fn frequency_hz(&self, kappa_rad: f64) -> f64 {
        let between_hz = (self.stiffness_n_per_m / self.mass_kg).sqrt() * (0.5 * kappa_rad).sin().abs() / PI;
        if self.ground_n_per_m > 0.0 { between_hz.hypot(self.cut_off_hz()) } else { between_hz }
    }

    /// Lower edge of the band in hertz, sqrt(k_g / m) / (2 pi): no wave of a lower frequency runs down the chain.
    pub fn cut_off_hz(&self) -> f64 {
        (self.ground_n_per_m / self.mass_kg).sqrt() / TAU
    }

    /// Upper edge of the band in hertz, sqrt(4 k_0 / m + k_g / m) / (2 pi): no wave of a higher frequency runs down the chain.
    pub fn band_edge_hz(&self) -> f64 {
        self.frequency_hz(PI)
    }

    /// Speed of the fastest waves in bodies a second. Without springs to ground they are the longest ones, sound: sqrt(k_0 / m). With
    /// them it is the largest group velocity, half the width of the band in radians a second.
    pub fn bodies_per_s(&self) -> f64 {
        if self.ground_n_per_m > 0.0 {
            return PI * (self.band_edge_hz() - self.cut_off_hz());
        }
        (self.stiffness_n_per_m / self.mass_kg).sqrt()
    }

    /// Speed of the fastest waves in metres per second, for a pitch in metres.
    pub fn sound_speed_m_per_s(&self, pitch_m: f64) -> f64 {
        pitch_m * self.bodies_per_s()
    }

    /// Time in seconds that the fastest waves take past `n_bodies` bodies.
    pub fn crossing_time_s(&self, n_bodies: usize) -> f64 {
        n_bodies as f64 / self.bodies_per_s()
    }

    /// The dashpot in kilograms per second at which one mass on one of the springs, 2 sqrt(k_0 m), no longer oscillates.
    pub fn critical_damping_kg_per_s(&self) -> f64 {
        2.0 * (self.stiffness_n_per_m * self.mass_kg).sqrt()
    }
}

impl Chain {
    /// The linear chain of the first gap's stiffness at zero overlap and the first body's mass and hold to ground, none for a chain without a body.
    pub fn linear(&self) -> Option<LinearChain> {
        let stiffness_n_per_m = self.contact.k_0_n_per_m();
        let ground_n_per_m = self.ground_at_rest_n_per_m().first().copied().unwrap_or(0.0);
        self.mass_kg.first().map(|&mass_kg| LinearChain { stiffness_n_per_m, mass_kg, ground_n_per_m })
    }
}
