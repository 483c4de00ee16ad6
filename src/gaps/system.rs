//! A multibody model with its gaps, loads and electrics: residual, tangent and charges.
//!
//! The residual is r(q, drive) = ∂Π/∂q − load, so that statics is r = 0 and dynamics M·q̈ + C·q̇ + r = 0.

use super::approach::Approach;
pub use super::approach::Point;
use super::capacitor::{Capacitance, Capacitor};
use super::contact::Contact;
use super::drive::{Drive, Electrics};
use super::facing::Facing;
use super::stop::{self, Stop};
use crate::multibody::planar::{self, Pose};
use crate::multibody::{BlockMatrix, BodyId, Model, forces};
use nalgebra::{SMatrix, SVector, Vector2, Vector4};

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

/// Twelve coordinates of the four bodies of a pair of facing beams.
type Quad = SVector<f64, 12>;

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
        for (gap, &volts) in self.gaps.iter().zip(&drive.volts) {
            self.add_gap_force(gap, q, -0.5 * volts * volts, true, r);
        }
        self.add_loads(q, -drive.load, r);
        self.add_input_forces(q, drive, r);
    }

    /// `tangent +=` the share of gaps, contacts and dead loads in ∂r/∂q.
    pub fn add_body_tangent(&self, q: &[Pose], drive: &Drive, tangent: &mut BlockMatrix<f64, 3>) {
        for (gap, &volts) in self.gaps.iter().zip(&drive.volts) {
            self.add_gap_tangent(gap, q, -0.5 * volts * volts, tangent);
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
        for ((gap, &volts), &dv) in self.gaps.iter().zip(&drive.volts).zip(&change.volts) {
            if dv != 0.0 {
                self.add_gap_force(gap, q, -volts * dv, false, out);
            }
        }
        if change.load != 0.0 {
            self.add_loads(q, -change.load, out);
        }
        self.add_input_change(q, drive, change, out);
        self.model.project(out);
    }

    /// Capacitance of a gap [F].
    pub fn capacitance(&self, gap: usize, q: &[Pose]) -> f64 {
        match &self.gaps[gap] {
            Gap::Single { approach, capacitor, .. } => capacitor.at(approach.value(q, self.model.linear)).value,
            Gap::Facing { ends, side, facing } => facing.at(&self.ends(ends, *side, q)).value,
            Gap::Stop { .. } => 0.0,
        }
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
                let c = facing.at(&self.ends(ends, *side, q));
                c.gradient.dot(&self.end_changes(ends, *side, q, dq))
            }
            Gap::Stop { .. } => 0.0,
        }
    }

    /// Distance left in a gap [m]: overlap of a comb, gap of plates, smallest gap of facing beams, way left to the nearer side of
    /// a stop.
    pub fn distance(&self, gap: usize, q: &[Pose]) -> f64 {
        match &self.gaps[gap] {
            Gap::Single { approach, capacitor, .. } => capacitor.distance(approach.value(q, self.model.linear)),
            Gap::Facing { ends, side, facing } => facing.closest(&self.ends(ends, *side, q)).0,
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
                let (_, weights) = facing.closest(&self.ends(ends, *side, q));
                weights.dot(&self.end_changes(ends, *side, q, dq))
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
            Gap::Facing { ends, .. } => quad(ends).to_vec(),
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

    /// `r += factor·∇C`, and the contact force when `touch`.
    fn add_gap_force(&self, gap: &Gap, q: &[Pose], factor: f64, touch: bool, r: &mut [Pose]) {
        match gap {
            Gap::Single { approach, capacitor, contact } => {
                let m = approach.measure(q, self.model.linear);
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
                let z = self.ends(ends, *side, q);
                let mut first = facing.at(&z).gradient * factor;
                if touch {
                    first += facing.contact(&z).0;
                }
                let f = self.end_rows(ends, *side, q).0.transpose() * first;
                for (i, id) in quad(ends).into_iter().enumerate() {
                    if let BodyId::Free(k) = id {
                        r[k] += f.fixed_rows::<3>(3 * i);
                    }
                }
            }
            Gap::Stop { approach, ways, stop } => {
                if !touch {
                    return;
                }
                let m = approach.measure(q, self.model.linear);
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

    /// `tangent += factor·∇²C + contact stiffness`.
    fn add_gap_tangent(&self, gap: &Gap, q: &[Pose], factor: f64, tangent: &mut BlockMatrix<f64, 3>) {
        match gap {
            Gap::Single { approach, capacitor, contact } => {
                let m = approach.measure(q, self.model.linear);
                let Capacitance { slope, curvature, .. } = capacitor.at(m.value);
                let (mut first, mut second) = (factor * slope, factor * curvature);
                if let Some(contact) = contact {
                    let (force, slope) = contact.force(capacitor.distance(m.value));
                    first += force;
                    second -= slope; // the distance shrinks as u grows
                }
                let h = m.hessian(first, second);
                self.model.place(approach.a.body, approach.b.body).add(tangent, &h);
            }
            Gap::Facing { ends, side, facing } => {
                let z = self.ends(ends, *side, q);
                let (field, (touch, stiffness)) = (facing.at(&z), facing.contact(&z));
                let first = field.gradient * factor + touch;
                let hz = field.hessian * factor + stiffness;
                let (rows, bend) = self.end_rows(ends, *side, q);
                let mut h: SMatrix<f64, 12, 12> = rows.transpose() * hz * rows;
                for i in 0..4 {
                    // bodies a, b, c, d; ends 0 (a, c) and 1 (b, d)
                    h[(3 * i + 2, 3 * i + 2)] += first[2 * (i % 2)] * bend[i];
                }
                self.add_quad(&quad(ends), &h, tangent);
            }
            Gap::Stop { approach, ways, stop } => {
                let m = approach.measure(q, self.model.linear);
                let (first, second) = stop.bearing(ways, m.value);
                if first != 0.0 {
                    let h = m.hessian(first, second);
                    self.model.place(approach.a.body, approach.b.body).add(tangent, &h);
                }
            }
        }
    }

    fn add_quad(&self, ids: &[BodyId; 4], h: &SMatrix<f64, 12, 12>, tangent: &mut BlockMatrix<f64, 3>) {
        for (i, &row) in ids.iter().enumerate() {
            for (j, &column) in ids.iter().enumerate() {
                let (BodyId::Free(row), BodyId::Free(column)) = (row, column) else { continue };
                let block = h.fixed_view::<3, 3>(3 * i, 3 * j);
                if row == column {
                    tangent.diagonal[row] += block;
                } else if row > column
                    && let Some(at) = self.model.pattern.block(row, column)
                {
                    tangent.below[at] += block;
                }
            }
        }
    }

    pub(super) fn ends(&self, ends: &[Approach; 2], side: f64, q: &[Pose]) -> Vector4<f64> {
        let w = |e: &Approach| e.value(q, self.model.linear);
        let turn = |e: &Approach| side * (e.a.rotation(q) - e.b.rotation(q));
        Vector4::new(w(&ends[0]), turn(&ends[0]), w(&ends[1]), turn(&ends[1]))
    }

    /// Change of z with a change `dq` of the configuration.
    pub(super) fn end_changes(&self, ends: &[Approach; 2], side: f64, q: &[Pose], dq: &[Pose]) -> Vector4<f64> {
        let mut d = Quad::zeros();
        for (i, id) in quad(ends).into_iter().enumerate() {
            d.fixed_rows_mut::<3>(3 * i).copy_from(&Model::pose(dq, id));
        }
        self.end_rows(ends, side, q).0 * d
    }

    /// ∂z/∂(bodies a, b, c, d), and ∂²w/∂θ² of each body.
    fn end_rows(&self, ends: &[Approach; 2], side: f64, q: &[Pose]) -> (SMatrix<f64, 4, 12>, [f64; 4]) {
        let mut rows = SMatrix::<f64, 4, 12>::zeros();
        let mut bend = [0.0; 4];
        for (e, end) in ends.iter().enumerate() {
            let m = end.measure(q, self.model.linear);
            for i in 0..3 {
                rows[(2 * e, 3 * e + i)] = m.gradient[i];
                rows[(2 * e, 6 + 3 * e + i)] = m.gradient[3 + i];
            }
            rows[(2 * e + 1, 3 * e + 2)] = side;
            rows[(2 * e + 1, 6 + 3 * e + 2)] = -side;
            (bend[e], bend[2 + e]) = (m.bend[0], m.bend[1]);
        }
        (rows, bend)
    }
}

fn quad(ends: &[Approach; 2]) -> [BodyId; 4] {
    [ends[0].a.body, ends[1].a.body, ends[0].b.body, ends[1].b.body]
}
