//! A multibody model with its gaps, loads and electrics: residual, tangent and charges.
//!
//! The residual is r(q, drive) = ∂Π/∂q − load, so that statics is r = 0 and dynamics M·q̈ + C·q̇ + r = 0.

use super::approach::MaterialPoint;
use super::beam_line::BeamLine;
use super::domain::{Chord, Configuration, Domain, SkewCoupling};
use super::drive::{Drive, Electrics};
use super::driven_anchor::DrivenAnchor;
use super::load::DeadLoad;
use super::loss_tangent::LossTangent;
use super::member::Member;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Model, forces};
use nalgebra::Vector2;
use std::sync::Arc;

/// The first 64 members, where the evaluation of their forces showed that nothing touches: contact loses nothing there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ApartMembers(u64);

impl ApartMembers {
    fn put(&mut self, member: usize, apart: bool) {
        if apart && member < 64 {
            self.0 |= 1 << member;
        }
    }

    fn has(self, member: usize) -> bool {
        member < 64 && self.0 >> member & 1 == 1
    }
}

/// The mechanical system that `solve` works on. Immutable; shared by sessions.
#[derive(Debug, Clone)]
pub struct System {
    /// Bodies and joints.
    pub model: Model,
    /// Force elements across gaps and on bodies, in the order of [`Drive::volts`]: gaps first.
    pub members: Vec<Member>,
    /// Dead loads.
    pub loads: Vec<DeadLoad>,
    /// Anchors whose displacement and rotation are inputs, or turned in the drawing.
    pub anchors: Vec<DrivenAnchor>,
    /// Ports, sources, heaters.
    pub electrics: Arc<Electrics>,
    /// Scale of displacements (m): the narrowest beam or the smallest gap, whichever is smaller; 1 µm without either.
    pub length_scale: f64,
    /// Centrelines of the beams in netlist order, which name directions of buckling.
    pub beams: Arc<Vec<BeamLine>>,
}

impl System {
    /// A mechanism on which nothing acts but its joints, with a length scale (m).
    #[inline]
    pub fn of_model(model: Model, length_scale: f64) -> Self {
        let (members, loads, anchors) = (Vec::new(), Vec::new(), Vec::new());
        Self { model, members, loads, anchors, electrics: Arc::default(), length_scale, beams: Arc::default() }
    }

    /// Bodies that move.
    #[inline]
    pub fn bodies(&self) -> usize {
        self.model.bodies.len()
    }

    /// `r = ∂Π/∂q − load`, held directions removed.
    #[inline]
    pub fn residual(&self, q: &[Pose], drive: &Drive, r: &mut [Pose]) {
        r.fill(Pose::zeros());
        forces::add_elastic(&self.model, q, &drive.rest(), r);
        self.add_body_forces(q, drive, r);
        self.model.project(r);
    }

    /// `r += ∂Π/∂q − load`, held directions removed from the sum. Goes from the last joint to the first: between sweeps
    /// over the bodies from the first to the last it finds in the caches what the one before left there.
    #[inline]
    pub fn add_residual(&self, q: &[Pose], drive: &Drive, r: &mut [Pose]) {
        self.add_residual_and(q, drive, r, |_, _| ());
    }

    /// The same with what `more` adds before held directions are removed.
    #[inline]
    pub fn add_residual_and(
        &self,
        q: &[Pose],
        drive: &Drive,
        r: &mut [Pose],
        more: impl FnOnce(&mut [Pose], ApartMembers),
    ) {
        forces::add_elastic_backwards(&self.model, q, &drive.rest(), r);
        let apart = self.add_body_forces(q, drive, r);
        more(r, apart);
        self.model.project(r);
    }

    /// `r +=` the share of gaps, contacts and dead loads in the residual: minus the wrench on each body. A formulation that
    /// has its own way with joints needs only this of a system. Returns members that it finds apart.
    #[inline]
    pub fn add_body_forces(&self, q: &[Pose], drive: &Drive, r: &mut [Pose]) -> ApartMembers {
        let (at, mut apart) = (self.at(q), ApartMembers::default());
        for (g, gap, volts) in self.active(&self.gap_voltages(q, &drive.volts)) {
            apart.put(g, gap.add_force_finding_apart(at, volts, r));
        }
        for load in &self.loads {
            load.add_force(at, drive.load, r);
        }
        self.add_input_forces(at, drive, r);
        apart
    }

    /// Members with a force of a potential, and their voltages (V).
    #[inline]
    fn active<'a>(&'a self, volts: &'a [f64]) -> impl Iterator<Item = (usize, &'a Member, f64)> {
        let all = self.members.iter().zip(volts).enumerate().map(|(g, (gap, volts))| (g, gap, *volts));
        all.filter(|(_, gap, volts)| gap.is_active(*volts))
    }

    /// True where [`System::add_body_forces`] adds anything.
    #[inline]
    pub fn is_acted_on(&self, drive: &Drive) -> bool {
        !(self.loads.is_empty() && self.anchors.is_empty() && drive.inputs.is_empty() && drive.push.is_empty())
            || self.members.iter().zip(&drive.volts).any(|(gap, volts)| gap.is_active(*volts))
    }

    /// True where [`System::add_body_forces`] adds anything to bodies as drawn.
    #[inline]
    pub fn is_acted_on_as_drawn(&self, drive: &Drive) -> bool {
        !(self.loads.is_empty() && self.anchors.is_empty() && drive.inputs.is_empty() && drive.push.is_empty())
            || self.members.iter().zip(&drive.volts).any(|(gap, volts)| gap.is_active_as_drawn(*volts))
    }

    /// `tangent +=` the share of gaps, contacts and dead loads in ∂r/∂q.
    #[inline]
    pub fn add_body_tangent(&self, q: &[Pose], drive: &Drive, tangent: &mut BodyMatrix) {
        let (at, pattern, volts) = (self.at(q), &self.model.pattern, self.gap_voltages(q, &drive.volts));
        for (_, gap, volts) in self.active(&volts) {
            gap.add_tangent(at, volts, pattern, tangent);
        }
        self.add_floating_tangent(q, &volts, 1.0, tangent);
        for load in &self.loads {
            load.add_tangent(at, drive.load, pattern, tangent);
        }
        self.add_input_tangent(at, drive, tangent);
    }

    /// The tangent ∂r/∂q and the residual r. Held directions of the tangent are left to the caller, which may add
    /// inertia.
    #[inline]
    pub fn tangent(&self, q: &[Pose], drive: &Drive, tangent: &mut BodyMatrix, r: &mut [Pose]) {
        r.fill(Pose::zeros());
        self.add_tangent(q, drive, tangent, r);
    }

    /// [`System::tangent`] with the residual added to `r`, held directions removed from the sum.
    #[inline]
    pub fn add_tangent(&self, q: &[Pose], drive: &Drive, tangent: &mut BodyMatrix, r: &mut [Pose]) {
        self.add_tangent_and(q, drive, tangent, r, |_, _| ());
    }

    /// The same with what `more` adds to `r` before held directions are removed.
    pub fn add_tangent_and(
        &self,
        q: &[Pose],
        drive: &Drive,
        tangent: &mut BodyMatrix,
        r: &mut [Pose],
        more: impl FnOnce(&mut [Pose], ApartMembers),
    ) {
        tangent.clear();
        forces::add_tangent(&self.model, q, &drive.rest(), tangent, r);
        let (at, pattern, mut apart) = (self.at(q), &self.model.pattern, ApartMembers::default());
        let volts = self.gap_voltages(q, &drive.volts);
        for (g, gap, volts) in self.active(&volts) {
            apart.put(g, gap.add_force_and_tangent_finding_apart(at, volts, pattern, (r, tangent)));
        }
        self.add_floating_tangent(q, &volts, 1.0, tangent);
        for load in &self.loads {
            load.add_force_and_tangent(at, drive.load, pattern, (r, tangent));
        }
        self.add_input_forces(at, drive, r);
        self.add_input_tangent(at, drive, tangent);
        more(r, apart);
        self.model.project(r);
    }

    /// The tangent at `here` less a fraction of that at `there`, held directions not removed; `r` is spoiled.
    pub fn tangent_less(
        &self,
        here: (&[Pose], &Drive),
        share: f64,
        there: (&[Pose], &Drive),
        tangent: &mut BodyMatrix,
        r: &mut [Pose],
    ) {
        tangent.clear();
        for (factor, (q, drive)) in [(-share, there), (1.0, here)] {
            forces::add_tangent(&self.model, q, &drive.rest(), tangent, r);
            self.add_body_tangent(q, drive, tangent);
            if factor != 1.0 {
                tangent.diagonal.iter_mut().chain(&mut tangent.below).for_each(|block| *block *= factor);
            }
        }
    }

    /// `out = (∂r/∂drive)·change` at `drive`, held directions removed.
    #[inline]
    pub fn drive_force(&self, q: &[Pose], drive: &Drive, change: &Drive, out: &mut [Pose]) {
        out.fill(Pose::zeros());
        self.add_drive_force(q, drive, change, out);
    }

    /// `out += (∂r/∂drive)·change` at `drive`, held directions removed from the sum.
    #[inline]
    pub fn add_drive_force(&self, q: &[Pose], drive: &Drive, change: &Drive, out: &mut [Pose]) {
        forces::add_rest_change(&self.model, q, &change.rest(), out);
        self.add_body_drive_force(q, drive, change, out);
        self.model.project(out);
    }

    /// The share of gaps, loads and inputs in that, held directions not removed.
    pub fn add_body_drive_force(&self, q: &[Pose], drive: &Drive, change: &Drive, out: &mut [Pose]) {
        let (at, volts) = (self.at(q), self.gap_voltages(q, &drive.volts));
        // linear in the voltages where the configuration is held
        let changes = self.gap_voltages(q, &change.volts);
        for ((gap, &volts), &dv) in self.members.iter().zip(&*volts).zip(&*changes) {
            if dv != 0.0 {
                gap.add_force_change(at, volts, dv, out);
            }
        }
        if change.load != 0.0 {
            for load in &self.loads {
                load.add_force_change(at, drive.load, change.load, out);
            }
        }
        self.add_input_change(at, drive, change, out);
    }

    /// `tangent +=` what the forces at `q` under `drive` add to the stiffness of a linear model; nothing in any other, whose tangent has it.
    ///
    /// Small displacements about the drawing have K of unstressed parts. Vibrations about an equilibrium have more: the forces N, V, M in
    /// the joints turn with them (K_σ of [`forces::add_stress_stiffness`]), and so do the points at which loads, voltage and contact act:
    /// [`System::add_levers`]. Left out, a beam of N segments under thrust is too stiff by a fraction that falls with 1/N only.
    #[inline]
    pub fn add_stress_stiffness(&self, q: &[Pose], drive: &Drive, tangent: &mut BodyMatrix) {
        forces::add_stress_stiffness(&self.model, q, &drive.rest(), tangent);
        self.add_levers(q, drive, tangent);
    }

    /// Its geometric part from the points of application of forces. A body that rotates by θ moves the point at its arm
    /// r. The force F keeps its direction and gets the lever −θ·r, a moment of −θ·(r·F).
    pub fn add_levers(&self, q: &[Pose], drive: &Drive, tangent: &mut BodyMatrix) {
        if !self.model.linear {
            return;
        }
        let mut lever = |point: MaterialPoint, force: Vector2<f64>| {
            if let BodyId::Free(k) = point.body {
                tangent.diagonal[k][(2, 2)] += point.arm.dot(&force);
            }
        };
        let at = self.at(q);
        for load in &self.loads {
            load.load_points(at, drive.load, &mut lever);
        }
        for (load, size) in self.given_loads(drive) {
            load.load_points(at, size, &mut lever);
        }
        for (gap, &volts) in self.members.iter().zip(&*self.gap_voltages(q, &drive.volts)) {
            gap.load_points(at, volts, &mut lever);
        }
    }

    /// [`System::tangent`] without what members add.
    pub fn tangent_without_members(&self, q: &[Pose], drive: &Drive, tangent: &mut BodyMatrix, r: &mut [Pose]) {
        tangent.clear();
        r.fill(Pose::zeros());
        forces::add_tangent(&self.model, q, &drive.rest(), tangent, r);
        let (at, pattern) = (self.at(q), &self.model.pattern);
        for load in &self.loads {
            load.add_force(at, drive.load, r);
            load.add_tangent(at, drive.load, pattern, tangent);
        }
        self.add_input_forces(at, drive, r);
        self.add_input_tangent(at, drive, tangent);
        self.model.project(r);
    }

    /// Adds the discrete forces of members over a step of length `h` (s) with the configurations `q` at its start, middle and end, and the
    /// symmetric part of their tangent with the end; held directions not removed.
    #[inline]
    pub fn add_quotients(&self, q: [&[Pose]; 3], h: f64, drive: &Drive, r: &mut [Pose], tangent: &mut BodyMatrix) {
        let chord = Chord { at: q.map(|q| self.at(q)), h };
        let volts = self.quotient_voltages(q, &drive.volts);
        let acts = |(gap, volts): &(&Member, &f64)| gap.is_active(**volts) || gap.damps();
        for (gap, &volts) in self.members.iter().zip(&*volts).filter(acts) {
            gap.add_quotient(&chord, volts, &self.model.pattern, r, tangent);
        }
        self.add_floating_tangent(q[1], &volts, 0.5, tangent);
    }

    /// True where parts are drawn to touch: all contacts but those of fingers at their sides.
    #[inline]
    pub fn can_touch(&self) -> bool {
        self.members.iter().any(|member| member.touching().is_some())
    }

    /// True where parts may touch by themselves: those drawn to touch, and fingers drawn off the middle of their gaps, which pull in across.
    #[inline]
    pub fn may_touch(&self) -> bool {
        let aside = |member: &Member| member.side_room().is_some_and(|(_, side)| side.drawn != 0.0);
        self.can_touch() || self.members.iter().any(aside)
    }

    /// True where there is any contact, that of fingers at their sides included.
    #[inline]
    pub fn has_contacts(&self) -> bool {
        self.members.iter().any(|member| member.touching().is_some() || member.side_room().is_some())
    }

    /// True where the sides of fingers touch at `q`, or may within `h` (s) at the rates `v`, by a bound.
    #[inline]
    pub fn sides_near(&self, q: &[Pose], v: &[Pose], h: f64) -> bool {
        let at = self.at(q);
        self.members.iter().any(|member| {
            member.side_contact(at).is_some_and(|side| side.left - h * member.closing_bound(v) < side.touch)
        })
    }

    /// True where forces of a member that depend on rates take energy out of a motion.
    #[inline]
    pub fn loses(&self) -> bool {
        self.members.iter().any(Domain::damps)
    }

    /// `r +=` the forces that rates add to those of members, `rate` the rate of each body; held directions not removed.
    #[inline]
    pub fn add_loss(&self, q: &[Pose], rate: impl Fn(usize) -> Pose, r: &mut [Pose]) {
        self.add_loss_near((q, ApartMembers::default()), rate, r);
    }

    /// The same without members that are known to be `apart` at `q`.
    #[inline]
    pub fn add_loss_near(&self, (q, apart): (&[Pose], ApartMembers), rate: impl Fn(usize) -> Pose, r: &mut [Pose]) {
        let at = self.at(q);
        self.near(apart).for_each(|member| member.add_loss(at, &rate, r));
    }

    fn near(&self, apart: ApartMembers) -> impl Iterator<Item = &Member> {
        self.members.iter().enumerate().filter(move |(g, _)| !apart.has(*g)).map(|(_, member)| member)
    }

    /// Adds the derivatives of those forces with displacements to `stiffness` and with rates to `damping`. True where there are any.
    #[inline]
    pub fn add_loss_tangent(
        &self,
        (q, apart): (&[Pose], ApartMembers),
        rate: impl Fn(usize) -> Pose,
        stiffness: &mut BodyMatrix,
        damping: &mut BodyMatrix,
    ) -> bool {
        let (at, mut to) = (self.at(q), LossTangent { pattern: &self.model.pattern, stiffness, damping });
        let add = |any, member: &Member| member.add_loss_tangent(at, &rate, &mut to) | any;
        self.near(apart).fold(false, add)
    }

    /// Calls `see` with the skew part of the derivatives of those forces with displacements.
    #[inline]
    pub fn skew_couplings(&self, q: &[Pose], rate: impl Fn(usize) -> Pose, mut see: impl FnMut(SkewCoupling)) {
        let at = self.at(q);
        self.members.iter().for_each(|member| member.skew_couplings(at, &rate, &mut see));
    }

    /// True where gas acts in a gap.
    #[inline]
    pub fn has_gas(&self) -> bool {
        self.members.iter().any(Domain::is_gas)
    }

    /// True where gas has states of its own.
    #[inline]
    pub fn compresses_gas(&self) -> bool {
        self.members.iter().any(|member| member.is_gas() && member.is_active(0.0))
    }

    /// Largest mean pressure of the gas in a gap over the ambient one (1), `rate` the rate of each body.
    pub fn film_pressure(&self, q: &[Pose], rate: impl Fn(usize) -> Pose) -> f64 {
        let at = self.at(q);
        self.members.iter().map(|member| member.film_pressure(at, &rate)).fold(0.0, f64::max)
    }

    /// Re dqᵀZ(ω)dq of the gas in gaps about a configuration at rest (N·s·m).
    #[inline]
    pub fn gas_damping(&self, q: &[Pose], dq: &[Pose], omega: f64) -> f64 {
        let at = self.at(q);
        self.members.iter().map(|member| member.gas_damping(at, dq, omega)).sum()
    }

    /// Bodies that gaps and dead loads act on, ascending.
    #[inline]
    pub fn acted_on(&self) -> Vec<usize> {
        let mut bodies = Vec::new();
        let mut see = |id: BodyId| {
            if let BodyId::Free(k) = id {
                bodies.push(k);
            }
        };
        self.members.iter().for_each(|gap| gap.bodies(&mut see));
        self.loads.iter().for_each(|load| load.bodies(&mut see));
        self.anchors.iter().for_each(|anchor| see(anchor.point.body));
        bodies.sort_unstable();
        bodies.dedup();
        bodies
    }

    /// A configuration, as domains take it.
    #[inline]
    pub(super) fn at<'a>(&self, q: &'a [Pose]) -> Configuration<'a> {
        Configuration { q, linear: self.model.linear }
    }
}
