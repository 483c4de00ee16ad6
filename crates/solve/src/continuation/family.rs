//! A family of systems over one number s: loads, built-in strains and source voltages go linearly from one state to another.
//!
//! At a fixed configuration the residual is then a polynomial of degree two in s: loads and built-in strains enter linearly,
//! the pull of gaps and the heat of resistors with the square of voltages. Its derivative is therefore the central
//! difference over any interval, exactly, and [`LoadFamily::slope`] is that, whatever a gap function's law in q.

use bimorph_domains::driven_anchor::DrivenAnchor;
use bimorph_domains::{DeadLoad, Drive, System};
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;
use thiserror::Error;

/// Half of the interval over which the residual is differenced (1). Exact for any; 1 keeps rounding smallest.
const HALF: f64 = 1.0;

/// Why two systems are no ends of one family.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum NotAFamily {
    /// Bodies, joints or gaps differ: geometry or stiffness changes, not loads alone.
    #[error("it changes the mechanism itself, not only loads, voltages, temperatures or stresses")]
    Mechanism,
    /// Heaters or the network differ.
    #[error("it changes the electrical network")]
    Network,
}

/// Data of one end of a family.
#[derive(Debug, Clone)]
struct FamilyEnd {
    loads: Vec<DeadLoad>,
    rest: Vec<f64>,
    anchors: Vec<[f64; 3]>,
    sources: Vec<f64>,
}

/// The family: a system whose loads, built-in strains and voltages are those at one s.
#[derive(Debug, Clone)]
pub struct LoadFamily {
    system: System,
    drive: Drive,
    sources: Vec<f64>,
    rise: Vec<f64>,
    ends: [FamilyEnd; 2],
    before: Vec<Pose>,
    still: Option<f64>,
}

impl LoadFamily {
    /// From `from` at source voltages `from_sources` (V) at s = 0 to `to` at s = 1.
    ///
    /// # Errors
    /// [`NotAFamily`] where anything else differs.
    pub fn new(from: &System, from_sources: &[f64], to: &System, to_sources: &[f64]) -> Result<Self, NotAFamily> {
        let (a, b) = (&from.model, &to.model);
        let same_joints = a.sections == b.sections
            && a.joints.len() == b.joints.len()
            && a.joints.iter().zip(&b.joints).all(|(x, y)| {
                let mut y = *y;
                y.rest = x.rest;
                *x == y
            });
        let same_points =
            from.loads.len() == to.loads.len() && from.loads.iter().zip(&to.loads).all(|(x, y)| x.point == y.point);
        let same_anchors = from.anchors.len() == to.anchors.len()
            && from.anchors.iter().zip(&to.anchors).all(|(x, y)| DrivenAnchor { drawn: x.drawn, ..y.clone() } == *x);
        let same = same_anchors
            && same_joints
            && same_points
            && a.bodies == b.bodies
            && a.dampers == b.dampers
            && from.members == to.members;
        if !same {
            return Err(NotAFamily::Mechanism);
        }
        let (e, f) = (&from.electrics, &to.electrics);
        if e.gap_rows != f.gap_rows || e.floating != f.floating || e.heating != f.heating || e.ports != f.ports {
            return Err(NotAFamily::Network);
        }
        let end = |system: &System, sources: &[f64]| FamilyEnd {
            loads: system.loads.clone(),
            rest: system.model.joints.iter().map(|j| j.rest).collect(),
            anchors: system.anchors.iter().map(|anchor| anchor.drawn).collect(),
            sources: sources.to_vec(),
        };
        let mut blend = Self {
            system: from.clone(),
            drive: e.drive(),
            sources: from_sources.to_vec(),
            rise: vec![0.0; e.heating.states()],
            ends: [end(from, from_sources), end(to, to_sources)],
            before: vec![Pose::zeros(); from.bodies()],
            still: field_free_point(from, from_sources, to_sources),
        };
        blend.set(0.0);
        Ok(blend)
    }

    /// Multiplies the dead loads (not built-in strains, not voltages) of both ends.
    pub fn scale_loads(&mut self, factors: [f64; 2]) {
        for (end, factor) in self.ends.iter_mut().zip(factors) {
            for load in &mut end.loads {
                load.force *= factor;
                load.moment *= factor;
            }
        }
        self.set(0.0);
    }

    /// Goes to `s`.
    pub fn set(&mut self, s: f64) {
        let [a, b] = &self.ends;
        let at = |a: f64, b: f64| a + s * (b - a);
        for (load, (a, b)) in self.system.loads.iter_mut().zip(a.loads.iter().zip(&b.loads)) {
            load.force = a.force + (b.force - a.force) * s;
            load.moment = at(a.moment, b.moment);
        }
        for (joint, (a, b)) in self.system.model.joints.iter_mut().zip(a.rest.iter().zip(&b.rest)) {
            joint.rest = at(*a, *b);
        }
        for (anchor, (a, b)) in self.system.anchors.iter_mut().zip(a.anchors.iter().zip(&b.anchors)) {
            anchor.drawn = [0, 1, 2].map(|k| at(a[k], b[k]));
        }
        for (source, (a, b)) in self.sources.iter_mut().zip(a.sources.iter().zip(&b.sources)) {
            *source = at(*a, *b);
        }
        self.system.electrics.steady(&self.sources, &mut self.rise, &mut self.drive);
    }

    /// Where every gap is without voltage, if the family comes through such an s with voltages on both sides.
    pub fn field_free_point(&self) -> Option<f64> {
        self.still
    }

    /// The system at the present s.
    pub fn system(&self) -> &System {
        &self.system
    }

    /// [`System::contact_scale`] at the present s.
    pub fn contact_scale(&self, q: &[Pose]) -> f64 {
        self.system.contact_scale(q, &self.drive.volts)
    }

    /// Tangent (held directions projected) and residual at the present s.
    pub fn tangent(&self, q: &[Pose], tangent: &mut BodyMatrix, r: &mut [Pose]) {
        self.system.tangent(q, &self.drive, tangent, r);
        self.system.model.project_matrix(tangent);
    }

    /// `out = ∂r/∂s` at `s`, where the family is left.
    pub fn slope(&mut self, q: &[Pose], s: f64, out: &mut [Pose]) {
        self.set(s - HALF);
        self.system.residual(q, &self.drive, &mut self.before);
        self.set(s + HALF);
        self.system.residual(q, &self.drive, out);
        for (out, before) in out.iter_mut().zip(&self.before) {
            *out = (*out - before) / (2.0 * HALF);
        }
        self.set(s);
    }
}

/// Where no gap has a voltage.
fn field_free_point(system: &System, from: &[f64], to: &[f64]) -> Option<f64> {
    let rows = &system.electrics.gap_rows;
    let gap = |g: usize, u: &[f64]| u.iter().enumerate().map(|(i, v)| rows[(g, i)] * v).sum::<f64>();
    let volts = (0..rows.nrows()).map(|g| [gap(g, from), gap(g, to)]).filter(|[a, b]| *a != 0.0 || *b != 0.0);
    let mut at = None;
    for [a, b] in volts {
        let s = a / (a - b);
        if !s.is_finite() || at.is_some_and(|at: f64| (at - s).abs() > 1e-12 * (1.0 + at.abs())) {
            return None;
        }
        at = Some(s);
    }
    at
}
