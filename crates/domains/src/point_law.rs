//! Laws of single scalars: what a field, a contact or a film does at one point of its rule of integration.
//!
//! A member whose potential is a sum Σ φ_k(u_k) over such points has its forces from the approaches u_k(q) alone. A model that knows
//! these as functions of few coordinates then needs no bodies. A pair of plates has one point; beams that face each other have those of their
//! quadrature. A comb has two, its approach along the fingers and its displacement across, whose common law stands with the first.

use super::attraction::attraction;
use super::capacitor::Capacitor;
use super::comb_sides::CombLaw;
use super::contact::Contact;
use super::squeeze_film::SqueezeFilm;
use super::stop::StopKind;
use bimorph_structure::Adhesion;

/// A law of one approach, as other simulators can write it down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// A field, and what bears where its conductors touch.
    Field(Capacitor, Option<Contact>),
    /// A stop with the ways to its two sides (m), and its adhesion.
    Stop([Option<f64>; 2], StopKind, Option<Adhesion>),
    /// A comb, of this approach and the next one.
    Comb(CombLaw),
    /// The displacement of the comb before it across its fingers.
    Across,
    /// Quadratic and cubic stiffness of a spring that the approach shortens (N/m², N/m³).
    Spring([f64; 2]),
}

/// The law of one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointLaw {
    /// Field, contact, stop or spring; none: gas alone.
    pub law: Option<Law>,
    /// χ of its contact (s/m); 0: elastic, or none.
    pub loss: f64,
    /// Distance as drawn (m) and damping of the gas in it.
    pub film: Option<(f64, SqueezeFilm)>,
}

/// A potential at one approach.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PointForce {
    /// Derivative of the potential with the approach (N): the force against it.
    pub force: f64,
    /// Second derivative (N/m).
    pub stiffness: f64,
}

impl PointLaw {
    /// A field without gas or loss.
    pub fn of(law: Law) -> Self {
        Self { law: Some(law), loss: 0.0, film: None }
    }

    /// Capacitance at the first of these approaches (m) (F); a comb has the next one, too.
    pub fn capacitance(&self, approaches: &[f64]) -> f64 {
        match &self.law {
            Some(Law::Field(capacitor, _)) => capacitor.at(approaches[0]).value,
            Some(Law::Comb(comb)) => comb.field([approaches[0], approaches[1]]).value,
            _ => 0.0,
        }
    }

    /// The comb whose law it is.
    pub fn comb(&self) -> Option<&CombLaw> {
        match &self.law {
            Some(Law::Comb(comb)) => Some(comb),
            _ => None,
        }
    }

    /// Force and stiffness at rest at the approach `u` (m) and `volts` (V), of a law of one approach.
    pub fn at(&self, u: f64, volts: f64) -> PointForce {
        match &self.law {
            None | Some(Law::Comb(_) | Law::Across) => PointForce::default(),
            Some(Law::Field(capacitor, contact)) => {
                let (c, half) = (capacitor.at(u), -0.5 * volts * volts);
                let pressed = contact.map_or((0.0, 0.0), |contact| contact.force(capacitor.distance(u)));
                PointForce { force: half * c.slope + pressed.0, stiffness: half * c.curvature - pressed.1 }
            }
            Some(Law::Stop(ways, stop, adhesion)) => {
                let bears = stop.bearing(ways, u);
                let side = |way: Option<f64>, u: f64| match (way, adhesion) {
                    (Some(way), Some(adhesion)) => attraction(adhesion, way - u),
                    _ => (0.0, 0.0, 0.0),
                };
                let (ahead, back) = (side(ways[0], u), side(ways[1], -u));
                PointForce { force: bears.0 - ahead.0 + back.0, stiffness: bears.1 + ahead.1 + back.1 }
            }
            Some(Law::Spring([quadratic, cubic])) => PointForce {
                force: (cubic * u - quadratic) * u * u,
                stiffness: (3.0 * cubic * u - 2.0 * quadratic) * u,
            },
        }
    }

    /// Whether its film is one that leaves at open edges alone.
    pub fn is_plain(&self) -> bool {
        self.film.is_none_or(|(_, film)| film.holes.is_none() && film.slit.is_none())
    }
}

#[cfg(test)]
mod tests {
    use super::super::edge_field::EdgeField;
    use super::*;

    /// The stiffness is the slope of the force, by central differences to 1e-5 of its size, of plates open and touching, a stop with
    /// adhesion on both sides, and a spring.
    #[test]
    fn stiffness_is_the_slope_of_the_force() {
        let plates = Capacitor::Plates {
            strength: 8.85e-20,
            edges: [EdgeField::None; 2],
            gap: 2e-6,
            shortening: 0.0,
            closest: 0.07e-6,
        };
        let contact = Contact { touch: 0.1e-6, area: 1e-9 };
        let adhesion = Adhesion { force: 2e-6, range: 20e-9 };
        let stop = Law::Stop([Some(0.5e-6), Some(0.3e-6)], StopKind::Elastic(1e3), Some(adhesion));
        let cases = [
            (Law::Field(plates, Some(contact)), vec![-1e-6, 0.3e-6, 1.901e-6, 1.91e-6]),
            (stop, vec![-0.302e-6, -0.29e-6, 0.1e-6, 0.488e-6, 0.503e-6]),
            (Law::Spring([1e5, 4e10]), vec![-1e-6, 0.4e-6]),
        ];
        for (law, points) in cases {
            let law = PointLaw::of(law);
            for u in points {
                let h = 1e-12;
                let slope = (law.at(u + h, 7.0).force - law.at(u - h, 7.0).force) / (2.0 * h);
                let found = law.at(u, 7.0).stiffness;
                assert!((slope - found).abs() <= 1e-5 * found.abs() + 1e-6, "{law:?} {u}: {slope} {found}");
            }
        }
    }
}
