//! A gap between bodies: the forces that a field in it and a contact make, and their tangent.

use super::approach::Approach;
use super::capacitor::{Capacitance, Capacitor};
use super::contact::Contact;
use super::facing::Facing;
use super::facing_ends;
use super::stop::Stop;
use crate::multibody::model::locate;
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, BodyId, Pattern};
use nalgebra::SMatrix;

/// A gap between bodies.
#[derive(Debug, Clone, PartialEq)]
pub enum Gap {
    /// Comb or lumped plates: one approach.
    Single {
        /// What it measures.
        approach: Approach,
        /// C(u).
        capacitor: Capacitor,
        /// How the parts touch; none: never.
        contact: Option<Contact>,
    },
    /// Two facing beams with ends a–c and b–d.
    Facing {
        /// Approaches of the ends: a against c, b against d, along the direction that opens the gap.
        ends: [Approach; 2],
        /// Sign of the slope that a positive rotation makes along the beams.
        side: f64,
        /// Constants.
        facing: Facing,
    },
    /// A stop, without a field.
    Stop {
        /// What it measures.
        approach: Approach,
        /// Way along the approach and against it until they touch [m].
        ways: [Option<f64>; 2],
        /// How it bears.
        stop: Stop,
    },
}

impl Gap {
    /// False where a gap adds no force at this voltage, wherever the bodies are.
    pub(crate) fn acts(&self, volts: f64) -> bool {
        volts != 0.0 || !matches!(self, Gap::Single { contact: None, .. })
    }

    /// True for electrodes that voltage draws upon each other.
    pub(crate) fn closes(&self) -> bool {
        matches!(self, Gap::Single { capacitor: Capacitor::Plates { .. }, .. } | Gap::Facing { .. })
    }

    /// `r += factor·∇C`, and the contact force when `touch`. `linear`: for small displacements.
    pub fn add_force(&self, linear: bool, q: &[Pose], factor: f64, touch: bool, r: &mut [Pose]) {
        match self {
            Gap::Single { approach, capacitor, contact } => {
                let m = approach.measure(q, linear);
                let mut first = factor * capacitor.at(m.value).slope;
                if let (true, Some(contact)) = (touch, contact) {
                    first += contact.force(capacitor.distance(m.value)).0;
                }
                let f = m.gradient * first;
                for (id, part) in [(approach.a.body, f.fixed_rows::<3>(0)), (approach.b.body, f.fixed_rows::<3>(3))] {
                    if let BodyId::Free(k) = id {
                        r[k] += part;
                    }
                }
            }
            Gap::Facing { ends, side, facing } => {
                let z = facing_ends::values(linear, ends, *side, q);
                let mut first = facing.at(&z).gradient * factor;
                if touch {
                    first += facing.contact(&z).0;
                }
                let f = facing_ends::rows(linear, ends, *side, q).0.transpose() * first;
                for (i, id) in facing_ends::bodies(ends).into_iter().enumerate() {
                    if let BodyId::Free(k) = id {
                        r[k] += f.fixed_rows::<3>(3 * i);
                    }
                }
            }
            Gap::Stop { approach, ways, stop } => {
                if !touch {
                    return;
                }
                let m = approach.measure(q, linear);
                let first = stop.bearing(ways, m.value).0;
                if first == 0.0 {
                    return;
                }
                let f = m.gradient * first;
                for (id, part) in [(approach.a.body, f.fixed_rows::<3>(0)), (approach.b.body, f.fixed_rows::<3>(3))] {
                    if let BodyId::Free(k) = id {
                        r[k] += part;
                    }
                }
            }
        }
    }

    /// Capacitance [F]; 0 of a stop. `linear`: for small displacements.
    pub fn capacitance(&self, linear: bool, q: &[Pose]) -> f64 {
        match self {
            Self::Single { approach, capacitor, .. } => capacitor.at(approach.value(q, linear)).value,
            Self::Facing { ends, side, facing } => facing.at(&facing_ends::values(linear, ends, *side, q)).value,
            Self::Stop { .. } => 0.0,
        }
    }

    /// `tangent += factor·∇²C + contact stiffness`, on a pattern that couples its bodies.
    /// `linear`: for small displacements.
    pub fn add_tangent(
        &self,
        (pattern, linear): (&Pattern, bool),
        q: &[Pose],
        factor: f64,
        tangent: &mut BlockMatrix<f64, 3>,
    ) {
        match self {
            Gap::Single { approach, capacitor, contact } => {
                let m = approach.measure(q, linear);
                let Capacitance { slope, curvature, .. } = capacitor.at(m.value);
                let (mut first, mut second) = (factor * slope, factor * curvature);
                if let Some(contact) = contact {
                    let (force, slope) = contact.force(capacitor.distance(m.value));
                    first += force;
                    second -= slope; // the distance shrinks as u grows
                }
                let h = m.hessian(first, second);
                locate(pattern, approach.a.body, approach.b.body).add(tangent, &h);
            }
            Gap::Facing { ends, side, facing } => {
                let z = facing_ends::values(linear, ends, *side, q);
                let (field, (touch, stiffness)) = (facing.at(&z), facing.contact(&z));
                let first = field.gradient * factor + touch;
                let hz = field.hessian * factor + stiffness;
                let (rows, bend) = facing_ends::rows(linear, ends, *side, q);
                let mut h: SMatrix<f64, 12, 12> = rows.transpose() * hz * rows;
                for i in 0..4 {
                    // bodies a, b, c, d; ends 0 (a, c) and 1 (b, d)
                    h[(3 * i + 2, 3 * i + 2)] += first[2 * (i % 2)] * bend[i];
                }
                add_quad(pattern, &facing_ends::bodies(ends), &h, tangent);
            }
            Gap::Stop { approach, ways, stop } => {
                let m = approach.measure(q, linear);
                let (first, second) = stop.bearing(ways, m.value);
                if first != 0.0 {
                    let h = m.hessian(first, second);
                    locate(pattern, approach.a.body, approach.b.body).add(tangent, &h);
                }
            }
        }
    }
}

/// Adds the tangent over four bodies.
fn add_quad(pattern: &Pattern, ids: &[BodyId; 4], h: &SMatrix<f64, 12, 12>, tangent: &mut BlockMatrix<f64, 3>) {
    for (i, &row) in ids.iter().enumerate() {
        for (j, &column) in ids.iter().enumerate() {
            let (BodyId::Free(row), BodyId::Free(column)) = (row, column) else { continue };
            let block = h.fixed_view::<3, 3>(3 * i, 3 * j);
            if row == column {
                tangent.diagonal[row] += block;
            } else if row > column
                && let Some(at) = pattern.block(row, column)
            {
                tangent.below[at] += block;
            }
        }
    }
}
