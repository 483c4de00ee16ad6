//! Contact of surfaces that nearly touch: a pressure that grows smoothly with the penetration.
//!
//! Surfaces a distance d apart touch below the touching distance t: that of a stop, an insulating layer or the highest
//! asperities; 0.1 µm, as in SUGAR 2.0's gap models (`gapCont`), unless a netlist says otherwise.
//! ```text
//! s = 2·(t − d)/t,      p(d) = P·s³ for s > 0,      P = 0.2 TPa
//! ```
//! p acts on the area that faces, so that parts of any size and any number of elements rest alike. It begins with two
//! continuous derivatives: equilibrium paths have no corner where contact begins, and an integrator of order 4 sees a smooth force.
//! Penetrations at t = 0.1 µm: 0.18 nm at 10 kPa, 0.85 nm at 1 MPa, 4.0 nm at 100 MPa. The law ends at s = 0.7, 69 GPa, which
//! no material bears: iterations find its continuation there, and results are refused.
//!
//! A part opens where the stiffness of the contact falls below that of the field. The penetration there, a share
//! √(t·K/(24·P)) of t at a field of stiffness K per area, lowers the voltage of release by as much: by 7e-5 for a relay of nanometres.
//!
//! Smooth penalty laws: P. Wriggers, "Computational Contact Mechanics" (2006), §5.2. The power 3 stands for asperities that
//! come to bear one after another, as in J. A. Greenwood, J. B. P. Williamson, Proc. R. Soc. A 295 (1966) 300; P is chosen
//! so that micromachined parts rest within a few nanometres of where they touch.

pub use bimorph_structure::{TOUCH, touching_distance};

/// Pressure P that the law is measured in (Pa).
pub const PRESSURE: f64 = 2e11;
/// Largest s for which the law holds (1).
pub const DEEPEST: f64 = 0.7;

/// Surfaces that face each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Distance at which they touch t (m).
    pub touch: f64,
    /// Area that faces (m²).
    pub area: f64,
}

impl Contact {
    /// Least distance at which the law holds (m).
    #[inline]
    pub fn least(&self) -> f64 {
        self.touch * (1.0 - 0.5 * DEEPEST)
    }

    /// Repulsive force (N) and its derivative with respect to the distance (N/m) (not positive) at distance `d` (m).
    #[inline]
    pub fn force(&self, d: f64) -> (f64, f64) {
        if d >= self.touch {
            return (0.0, 0.0);
        }
        let s = self.share(d);
        let square = self.area * PRESSURE * s * s;
        (square * s, -6.0 * square / self.touch)
    }

    /// Energy stored at distance `d` (J): the integral of the force from there to where it begins.
    #[inline]
    pub fn energy(&self, d: f64) -> f64 {
        if d >= self.touch { 0.0 } else { 0.125 * self.touch * self.area * PRESSURE * self.share(d).powi(4) }
    }

    fn share(&self, d: f64) -> f64 {
        2.0 * (self.touch - d) / self.touch
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAIR: Contact = Contact { touch: 0.1e-6, area: 1e-9 };

    /// p = P·s³ as documented: 10 kPa at 0.18 nm, 1 MPa at 0.85 nm, 100 MPa at 4.0 nm, 68.6 GPa where the law ends; nothing at the
    /// touching distance; twice the area bears twice the force.
    #[test]
    fn follows_its_law() {
        for (penetration, pressure) in
            [(0.184_201_6e-9, 1e4), (0.854_988_0e-9, 1e6), (3.968_503e-9, 1e8), (35e-9, 6.86e10)]
        {
            let d = PAIR.touch - penetration;
            let (f, slope) = PAIR.force(d);
            assert!((f / (1e-9 * pressure) - 1.0).abs() < 1e-6, "{d}: {f}");
            assert!((slope * penetration / (-3.0 * f) - 1.0).abs() < 1e-9, "{d}: {slope}");
        }
        assert_eq!(PAIR.least(), PAIR.touch * 0.65);
        assert_eq!(PAIR.force(0.1e-6), (0.0, 0.0));
        let wide = Contact { area: 2e-9, ..PAIR };
        assert_eq!(wide.force(0.08e-6).0, 2.0 * PAIR.force(0.08e-6).0);
    }

    /// The energy's slope is the force, within the range and beyond: central differences of 1e-12 m.
    #[test]
    fn energy_is_the_integral_of_the_force() {
        for d in [0.099e-6, 0.09e-6, 0.06e-6, -0.02e-6] {
            let slope = (PAIR.energy(d - 1e-12) - PAIR.energy(d + 1e-12)) / 2e-12;
            let force = PAIR.force(d).0;
            assert!((slope / force - 1.0).abs() < 1e-5, "{d}: {slope} {force}");
        }
        assert_eq!(PAIR.energy(PAIR.touch), 0.0);
    }

    /// Surfaces drawn closer than twice the touching distance touch at half of what was drawn.
    #[test]
    fn small_gaps_touch_at_half() {
        assert_eq!([touching_distance(2e-6), touching_distance(0.12e-6)], [0.1e-6, 0.06e-6]);
    }
}
