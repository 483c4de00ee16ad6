//! Backbending: a hot arm that was heated too far is shorter ever after, and the cold actuator rests bent the other way.
//!
//! While it is hot, an arm that the rest of the mechanism holds back is pressed along its axis. Polysilicon loses its
//! strength with temperature; where the pressure would exceed what the arm can bear at its mean temperature T̄, it is shortened for good
//! by a plastic strain ε (ideal plasticity, no hardening, no creep in time):
//! ```text
//! σ_y(T) = σ_0·(T_s − T)/(T_s − T_0)  for T < T_s, else 0        T_0 ambient: full strength; T_s: no strength left
//! −N/A ≤ σ_y(T̄),   ε never falls,   rest length h·(1 + α·(T̄ − T_0) − ε)
//! ```
//! This is a rest offset like thermal expansion, with the opposite sign (Popa et al. 2004, Q4 and Fig. 3: "a negative
//! spring constant shortening the beam"). The model omits bending stress across the arm, yield in tension during
//! cooling, and time. σ_0 and T_s are constants of a process to be fitted; published ones were not found.
//!
//! Reference: J. C. Simo, T. J. R. Hughes, "Computational inelasticity" (1998), §1.2: the return to the yield surface.

/// Strength of a material against pressure along a beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strength {
    /// Yield stress at ambient temperature σ_0 (Pa).
    pub cold: f64,
    /// Ambient temperature T_0 (K).
    pub ambient: f64,
    /// Temperature at which no strength is left T_s (K), above T_0.
    pub softening: f64,
}

impl Strength {
    /// Yield stress at temperature `t` (Pa).
    #[inline]
    pub fn at(&self, t: f64) -> f64 {
        self.cold * ((self.softening - t) / (self.softening - self.ambient)).max(0.0)
    }

    /// By how much the pressure `stress` (Pa) (positive: pressed) exceeds it at temperature `t`; negative: it holds.
    #[inline]
    pub fn excess(&self, stress: f64, t: f64) -> f64 {
        stress - self.at(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Full strength at ambient, half of it half way to softening, none above.
    #[test]
    fn strength_falls_with_temperature() {
        let s = Strength { cold: 1e9, ambient: 300.0, softening: 1300.0 };
        assert_eq!([s.at(300.0), s.at(800.0), s.at(1300.0), s.at(2000.0)], [1e9, 5e8, 0.0, 0.0]);
        assert!(s.excess(6e8, 800.0) > 0.0 && s.excess(4e8, 800.0) < 0.0);
    }
}
