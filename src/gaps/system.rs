//! A multibody model with its gaps, loads and electrics: residual, tangent and charges.
//!
//! The residual is r(q, drive) = ∂Π/∂q − load, so that statics is r = 0 and dynamics M·q̈ + C·q̇ + r = 0.

use super::approach::Approach;
pub use super::approach::Point;
use super::capacitor::Capacitor;
use super::drive::{Drive, Electrics};
use super::facing_ends;
pub use super::gap::Gap;
use super::stop;
use crate::multibody::planar::{self, Pose};
use crate::multibody::{BlockMatrix, BodyId, Model, forces};
use nalgebra::Vector2;

/// A dead load on a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Where it acts.
    pub point: Point,
    /// Force [N].
    pub force: Vector2<f64>,
    /// Moment [N·m].
    pub moment: f64,
}

/// What `solve` works on. Immutable; shared by sessions.
#[derive(Debug, Clone)]
pub struct System {
    /// Bodies and joints.
    pub model: Model,
    /// Gaps, in the order of [`Drive::volts`].
    pub gaps: Vec<Gap>,
    /// Dead loads.
    pub loads: Vec<Load>,
    /// Ports, sources, heaters.
    pub electrics: Electrics,
    /// What displacements are measured against [m]: the narrowest beam or the smallest gap, whichever is smaller; 1 µm where
    /// there is neither.
    pub length_scale: f64,
}

impl System {
    /// Bodies that move.
    pub fn bodies(&self) -> usize {
        self.model.bodies.len()
    }

    /// `r = ∂Π/∂q − load`, held directions removed.
    pub fn residual(&self, q: &[Pose], drive: &Drive, r: &mut [Pose]) {
        r.fill(Pose::zeros());
        forces::add_elastic(&self.model, q, &drive.rest(), r);
        self.add_body_forces(q, drive, r);
        self.model.project(r);
    }

    /// `r += ∂Π/∂q − load`, held directions removed from the sum. Goes from the last joint to the first: between sweeps
    /// over the bodies from the first to the last it finds in the caches what the one before left there.
    pub fn add_residual(&self, q: &[Pose], drive: &Drive, r: &mut [Pose]) {
        forces::add_elastic_backwards(&self.model, q, &drive.rest(), r);
        self.add_body_forces(q, drive, r);
        self.model.project(r);
    }

    /// `r +=` the share of gaps, contacts and dead loads in the residual: minus the wrench on each body. A formulation that
    /// has its own way with joints needs only this of a system.
    pub fn add_body_forces(&self, q: &[Pose], drive: &Drive, r: &mut [Pose]) {
        for (gap, &volts) in self.gaps.iter().zip(&drive.volts).filter(|(gap, volts)| gap.acts(**volts)) {
            gap.add_force(self.model.linear, q, -0.5 * volts * volts, true, r);
        }
        self.add_loads(q, -drive.load, r);
        self.add_input_forces(q, drive, r);
    }

    /// True where [`System::add_body_forces`] adds anything.
    pub(crate) fn is_acted_on(&self, drive: &Drive) -> bool {
        !(self.loads.is_empty() && drive.inputs.is_empty() && drive.push.is_empty())
            || self.gaps.iter().zip(&drive.volts).any(|(gap, volts)| gap.acts(*volts))
    }

    /// `tangent +=` the share of gaps, contacts and dead loads in ∂r/∂q.
    pub fn add_body_tangent(&self, q: &[Pose], drive: &Drive, tangent: &mut BlockMatrix<f64, 3>) {
        for (gap, &volts) in self.gaps.iter().zip(&drive.volts).filter(|(gap, volts)| gap.acts(**volts)) {
            gap.add_tangent((&self.model.pattern, self.model.linear), q, -0.5 * volts * volts, tangent);
        }
        self.add_load_tangent(q, -drive.load, tangent);
        self.add_input_tangent(q, drive, tangent);
    }

    /// The tangent ∂r/∂q and the residual r. The tangent's held directions are left to the caller, who may add inertia.
    pub fn tangent(&self, q: &[Pose], drive: &Drive, tangent: &mut BlockMatrix<f64, 3>, r: &mut [Pose]) {
        r.fill(Pose::zeros());
        self.add_tangent(q, drive, tangent, r);
    }

    /// [`System::tangent`] with the residual added to `r`, held directions removed from the sum.
    pub fn add_tangent(&self, q: &[Pose], drive: &Drive, tangent: &mut BlockMatrix<f64, 3>, r: &mut [Pose]) {
        tangent.clear();
        forces::add_tangent(&self.model, q, &drive.rest(), tangent, r);
        self.add_body_forces(q, drive, r);
        self.add_body_tangent(q, drive, tangent);
        self.model.project(r);
    }

    /// `out = (∂r/∂drive)·change` at `drive`, held directions removed.
    pub fn drive_force(&self, q: &[Pose], drive: &Drive, change: &Drive, out: &mut [Pose]) {
        out.fill(Pose::zeros());
        self.add_drive_force(q, drive, change, out);
    }

    /// `out += (∂r/∂drive)·change` at `drive`, held directions removed from the sum.
    pub fn add_drive_force(&self, q: &[Pose], drive: &Drive, change: &Drive, out: &mut [Pose]) {
        forces::add_rest_change(&self.model, q, &change.rest(), out);
        self.add_body_drive_force(q, drive, change, out);
        self.model.project(out);
    }

    /// The share of gaps, loads and inputs in that, held directions not removed.
    pub fn add_body_drive_force(&self, q: &[Pose], drive: &Drive, change: &Drive, out: &mut [Pose]) {
        for ((gap, &volts), &dv) in self.gaps.iter().zip(&drive.volts).zip(&change.volts) {
            if dv != 0.0 {
                gap.add_force(self.model.linear, q, -volts * dv, false, out);
            }
        }
        if change.load != 0.0 {
            self.add_loads(q, -change.load, out);
        }
        self.add_input_change(q, drive, change, out);
    }

    /// Capacitance of a gap [F].
    pub fn capacitance(&self, gap: usize, q: &[Pose]) -> f64 {
        self.gaps[gap].capacitance(self.model.linear, q)
    }

    /// Change of a gap's capacitance with a change `dq` of the configuration [F].
    pub fn capacitance_slope(&self, gap: usize, q: &[Pose], dq: &[Pose]) -> f64 {
        match &self.gaps[gap] {
            Gap::Single { approach, capacitor, .. } => {
                let m = approach.measure(q, self.model.linear);
                let (da, db) = (Model::pose(dq, approach.a.body), Model::pose(dq, approach.b.body));
                let g = &m.gradient;
                capacitor.at(m.value).slope * (g.fixed_rows::<3>(0).dot(&da) + g.fixed_rows::<3>(3).dot(&db))
            }
            Gap::Facing { ends, side, facing } => {
                let c = facing.at(&facing_ends::values(self.model.linear, ends, *side, q));
                c.gradient.dot(&facing_ends::changes(self.model.linear, ends, *side, q, dq))
            }
            Gap::Stop { .. } => 0.0,
        }
    }

    /// Distance left in a gap [m]: overlap of a comb, gap of plates, smallest gap of facing beams, way left to the nearer side of
    /// a stop.
    pub fn distance(&self, gap: usize, q: &[Pose]) -> f64 {
        match &self.gaps[gap] {
            Gap::Single { approach, capacitor, .. } => capacitor.distance(approach.value(q, self.model.linear)),
            Gap::Facing { ends, side, facing } => {
                facing.closest(&facing_ends::values(self.model.linear, ends, *side, q)).0
            }
            Gap::Stop { approach, ways, .. } => stop::nearer(ways, approach.value(q, self.model.linear)).0,
        }
    }

    /// Change of a gap's distance with a change `dq` of the configuration [m].
    pub fn distance_slope(&self, gap: usize, q: &[Pose], dq: &[Pose]) -> f64 {
        let along = |a: &Approach| {
            let g = a.measure(q, self.model.linear).gradient;
            g.fixed_rows::<3>(0).dot(&Model::pose(dq, a.a.body)) + g.fixed_rows::<3>(3).dot(&Model::pose(dq, a.b.body))
        };
        match &self.gaps[gap] {
            Gap::Single { approach, capacitor: Capacitor::Comb { .. }, .. } => along(approach),
            Gap::Single { approach, .. } => -along(approach),
            Gap::Facing { ends, side, facing } => {
                let (_, weights) = facing.closest(&facing_ends::values(self.model.linear, ends, *side, q));
                weights.dot(&facing_ends::changes(self.model.linear, ends, *side, q, dq))
            }
            Gap::Stop { approach, ways, .. } => {
                stop::nearer(ways, approach.value(q, self.model.linear)).1 * along(approach)
            }
        }
    }

    /// Bodies that gaps and dead loads act on, ascending.
    pub fn acted_on(&self) -> Vec<usize> {
        let of_gap = |gap: &Gap| match gap {
            Gap::Single { approach, .. } | Gap::Stop { approach, .. } => vec![approach.a.body, approach.b.body],
            Gap::Facing { ends, .. } => facing_ends::bodies(ends).to_vec(),
        };
        let ids = self.gaps.iter().flat_map(of_gap).chain(self.loads.iter().map(|load| load.point.body));
        let free = |id: BodyId| if let BodyId::Free(k) = id { Some(k) } else { None };
        let mut bodies: Vec<usize> = ids.filter_map(free).collect();
        bodies.sort_unstable();
        bodies.dedup();
        bodies
    }

    fn add_loads(&self, q: &[Pose], scale: f64, r: &mut [Pose]) {
        for load in &self.loads {
            if let BodyId::Free(k) = load.point.body {
                let mut w = planar::wrench(&q[k], load.point.arm, load.force, self.model.linear);
                w.z += load.moment;
                r[k] += w * scale;
            }
        }
    }

    fn add_load_tangent(&self, q: &[Pose], scale: f64, tangent: &mut BlockMatrix<f64, 3>) {
        for load in &self.loads {
            if let BodyId::Free(k) = load.point.body {
                let (_, bend) = planar::point_turn(&q[k], load.point.arm, self.model.linear);
                tangent.diagonal[k][(2, 2)] += scale * bend.dot(&load.force);
            }
        }
    }
}
