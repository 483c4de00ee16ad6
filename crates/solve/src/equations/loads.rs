//! Loads on the bodies and joints of a mechanism in joint coordinates, and their implementation for a system whose
//! sources follow a ramp.
//!
//! Gaps, contacts and dead loads give each body its wrench, −(∂Π/∂q − load); gas and dampers −C·q̇; springs act along
//! the joint coordinates. Heat and residual stress shift the rest length of an elastic axial direction, and prescribe a
//! locked one. The rate of that prescribed length is taken as zero, so that its slow change has inertia only through
//! the bodies it moves. A time constant of heat much longer than the period of what moves makes this right.

use bimorph_domains::loss_derivatives::LossDerivatives;
use bimorph_domains::{Drive, Ramp, System};
use bimorph_multibody::forces;
use bimorph_multibody::joint_coordinates::constrained_loops::{AddedInertia, Closure, Linkage, Reduction};
use bimorph_multibody::planar::{DOF, Pose};

/// Loads on a mechanism in joint coordinates.
pub trait Loads {
    /// Sets what time alone prescribes, such as the offsets of heated joints that are locked, at `t` (s). Before placing.
    fn prescribe(&mut self, t: f64, reduction: &mut Reduction<f64>) {
        let _ = (t, reduction);
    }

    /// Adds what acts at time `t` (s) to the force and torque of `reduction`, whose bodies are placed at `q` and `v`.
    fn add(&mut self, t: f64, q: &[f64], v: &[f64], reduction: &mut Reduction<f64>);

    /// Adds β·K + γ·C of what acts where [`Loads::add`] was last called; `factors` are β (s²) and γ (s). Omitted terms
    /// cost iterations, not accuracy.
    fn stiffen(&mut self, reduction: &Reduction<f64>, factors: (f64, f64), added: &mut AddedInertia) {
        let _ = (reduction, factors, added);
    }
}

/// Loads of a system while its sources go along a ramp, with storage for them.
#[derive(Debug, Clone)]
pub struct JointLoads<'a> {
    system: &'a System,
    linkage: &'a Linkage,
    ramp: &'a Ramp<'a>,
    drive: Drive,
    q: Vec<Pose>,
    v: Vec<Pose>,
    r: Vec<Pose>,
    prescribes: bool,
    /// Derivatives of what contact loses with displacements and rates; none where it loses nothing.
    loss: Option<LossDerivatives>,
}

impl<'a> JointLoads<'a> {
    /// Storage. `linkage` spans the bodies of `system`, in the same order.
    pub fn new(system: &'a System, linkage: &'a Linkage, ramp: &'a Ramp<'a>) -> Self {
        let zeros = vec![Pose::zeros(); system.bodies()];
        let heated = linkage.links.iter().any(|l| !l.moving[0] && (l.rest != 0.0 || l.expansion.is_some()))
            || linkage.closures.iter().any(|c| match c {
                Closure::Joint(j) => j.locked[0] && (j.rest != 0.0 || j.expansion.is_some()),
                Closure::Held { .. } => false,
            });
        Self {
            system,
            linkage,
            ramp,
            drive: system.electrics.drive(),
            q: zeros.clone(),
            v: zeros.clone(),
            r: zeros,
            prescribes: heated,
            loss: LossDerivatives::of(system),
        }
    }

    /// Places the bodies at time `t` (s) of the ramp, locked directions at their prescribed lengths.
    pub fn place(&mut self, t: f64, q: &[f64], v: &[f64], reduction: &mut Reduction<f64>) {
        self.prescribe(t, reduction);
        reduction.place(q, v);
    }

    /// [`Loads::add`] at what is prescribed at that time, where the bodies are placed anew if anything is.
    pub fn add(&mut self, t: f64, q: &[f64], v: &[f64], reduction: &mut Reduction<f64>) {
        if self.prescribes {
            self.place(t, q, v, reduction);
        }
        Loads::add(self, t, q, v, reduction);
    }
}

impl Loads for JointLoads<'_> {
    fn prescribe(&mut self, t: f64, reduction: &mut Reduction<f64>) {
        if self.prescribes {
            self.ramp.at(t, &mut self.drive);
            reduction.prescribe(self.linkage, &self.drive.rest());
        }
    }

    fn add(&mut self, t: f64, q: &[f64], _: &[f64], reduction: &mut Reduction<f64>) {
        self.ramp.at(t, &mut self.drive);
        poses(reduction, &mut self.q, &mut self.v);
        self.r.fill(Pose::zeros());
        self.system.add_body_forces(&self.q, &self.drive, &mut self.r);
        forces::add_damping(&self.system.model, &self.v, &mut self.r);
        if self.loss.is_some() {
            self.system.add_loss(&self.q, |k| self.v[k], &mut self.r);
        }
        for (force, r) in reduction.force.iter_mut().zip(&self.r) {
            for i in 0..DOF {
                force[i] -= r[i];
            }
        }
        reduction.add_elastic(self.linkage, q, &self.drive.rest());
    }

    fn stiffen(&mut self, reduction: &Reduction<f64>, (beta, gamma): (f64, f64), added: &mut AddedInertia) {
        let bodies = &mut added.bodies;
        self.system.add_body_tangent(&self.q, &self.drive, bodies);
        bodies.diagonal.iter_mut().chain(&mut bodies.below).for_each(|block| *block *= beta);
        forces::add_inertia(&self.system.model, 0.0, gamma, bodies);
        if let Some(loss) = &mut self.loss {
            loss.at(self.system, &self.q, |k| self.v[k]);
            loss.add_to([beta, gamma], bodies);
        }
        reduction.add_stiffness(self.linkage, beta, added);
    }
}

/// Poses and rates of the placed bodies.
pub fn poses(reduction: &Reduction<f64>, q: &mut [Pose], v: &mut [Pose]) {
    for (k, (q, v)) in q.iter_mut().zip(v).enumerate() {
        *q = reduction.pose(k).into();
        *v = reduction.rate(k).into();
    }
}
