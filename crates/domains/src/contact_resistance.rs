//! The conductance of two metal surfaces that are pressed on each other.
//!
//! A spot of radius a bears the force F at the hardness H of the softer metal. Its resistance is that of the constriction (Holm) and that of
//! electrons which cross it without collisions (Sharvin), with the resistivity ρ and the mean free path λ of the electrons:
//! ```text
//! a = √(F/(π·H))      R = Γ(λ/a)·ρ/(2·a) + 4·ρ·λ/(3·π·a²)      Γ(K) = (1 + 0.83·K)/(1 + 1.33·K)      G = 1/R
//! ```
//! G is 0 without force and grows smoothly from there.
//!
//! Sources: R. Holm, "Electric Contacts" (1967); G. Wexler, Proc. Phys. Soc. 89 (1966) 927; Γ as fitted by B. Nikolić, P. B. Allen, Phys. Rev. B 60
//! (1999) 3963.

use bimorph_structure::OhmicContact;
use std::f64::consts::PI;

/// Conductance at the force `force` (N) and its derivative with the force (S, S/N).
pub fn conductance(contact: &OhmicContact, force: f64) -> (f64, f64) {
    let &OhmicContact { hardness, resistivity, electron_path } = contact;
    if force <= 0.0 {
        return (0.0, 0.0);
    }
    let a = (force / (PI * hardness)).sqrt();
    // R = ρ·(Γ/(2a) + 4λ/(3πa²)), times a² over ρ: n = Γ·a/2 + 4λ/(3π), with Γ = (a + 0.83·λ)/(a + 1.33·λ)
    let (upper, lower) = (a + 0.83 * electron_path, a + 1.33 * electron_path);
    let share = upper / lower;
    let share_slope = (lower - upper) / (lower * lower);
    let n = 0.5 * share * a + 4.0 * electron_path / (3.0 * PI);
    let n_slope = 0.5 * (share + a * share_slope);
    let value = a * a / (resistivity * n);
    let by_radius = (2.0 * a * n - a * a * n_slope) / (resistivity * n * n);
    (value, by_radius * 0.5 * a / force)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOLD: OhmicContact = OhmicContact { hardness: 2e9, resistivity: 2.2e-8, electron_path: 38e-9 };

    /// Gold at 100 µN, H = 2 GPa, ρ = 22 nΩ·m: 87.193 mΩ by Holm without a mean free path, and 22.293 mΩ by Sharvin beside it at λ = 38 nm (closed
    /// forms).
    #[test]
    fn gold() {
        let holm = 1.0 / conductance(&OhmicContact { electron_path: 0.0, ..GOLD }, 1e-4).0;
        assert!((holm / 0.087193 - 1.0).abs() < 1e-4, "{holm}");
        let k = 38e-9 / (1e-4 / (PI * 2e9)).sqrt();
        let sharvin = 1.0 / conductance(&GOLD, 1e-4).0 - holm * (1.0 + 0.83 * k) / (1.0 + 1.33 * k);
        assert!((sharvin / 0.022293 - 1.0).abs() < 1e-4, "{sharvin}");
    }

    /// The derivative is that of differences, from nano- to millinewtons; without force nothing conducts.
    #[test]
    fn derivative() {
        for path in [0.0, 38e-9] {
            let contact = OhmicContact { electron_path: path, ..GOLD };
            for force in [1e-9, 1e-6, 1e-4, 1e-3] {
                let h = 1e-5 * force;
                let slope = (conductance(&contact, force + h).0 - conductance(&contact, force - h).0) / (2.0 * h);
                assert!((conductance(&contact, force).1 / slope - 1.0).abs() < 1e-7);
            }
            assert_eq!(conductance(&contact, 0.0), (0.0, 0.0));
        }
    }
}
