//! Trials in a reduced model, and where the full model takes over from it.
//!
//! A state of the reduced model carries its coordinates ([`Snapshot::carried`]), unless it lies in a macro step; one of the full model carries none, and the
//! trials from it are those of the full model. Every decision follows from the request and its parent alone, so that trials stay pure:
//!
//! * An equilibrium is reduced where the reduced branch from a reduced parent reaches it, the polynomials have it within the trained amplitude, and the
//!   residual of the full model there is an error within the tolerance.
//! * A step from a reduced state is reduced, unless a port is given more than its range or the motion goes far beyond the trained one.
//! * A state whose amplitude is beyond the trained one, or at which the polynomials miss their part of the tolerance, is answered and then carries no
//!   coordinates: all trials of the next point have the full model.

use crate::session::DeviceSession;
use crate::session::reduction::SessionReduction;
use crate::states::Snapshot;
use bimorph_analysis::reduced::circuit::CircuitReduction;
use bimorph_analysis::reduced::{TRAINED, beyond, taken};
use bimorph_base::Diagnostic;
use bimorph_domains::System;
use bimorph_model::compile::CompiledModel;
use bimorph_solve::path::LoadPath;
use bimorph_solve::time::method::Motion;
use std::sync::Arc;

/// States between two comparisons of the polynomials with exact kinematics.
const EVERY: f64 = 20.0;
/// Excess over the trained states (1) from which on a step is taken again in the full model.
const FAR: f64 = 1.5;
/// Size of the warning that the full model has taken over: more than that of any error, in units of the tolerance (1).
const LEFT: f64 = 1e6;
/// Code of the warnings.
const WARNING: &str = "W053";

/// Coordinates that a method continues from at a state, in a session with a reduced model if `reduced`; none: those of the motion of the bodies.
pub(super) fn state_of(state: &Snapshot, reduced: bool) -> Option<&[Motion]> {
    let is_projected = reduced && state.carried.is_empty() && state.macro_step.is_some();
    (!is_projected).then_some(&state.carried)
}

impl DeviceSession {
    /// Whether trials from a state are those of the reduced model.
    pub(crate) fn is_reduced_state(&self, state: &Snapshot) -> bool {
        self.reduction.is_some() && (!state.carried.is_empty() || state.macro_step.is_some())
    }

    /// Whether a port is given more than the reduced model is trained for.
    pub(crate) fn is_beyond(&self, sources: &[f64]) -> bool {
        self.reduction.as_ref().is_some_and(|reduction| reduction.model.beyond(sources).is_some())
    }

    /// The reduced model of its trials.
    pub(crate) fn reduced_model(&self) -> Option<&Arc<CircuitReduction>> {
        self.reduction.as_ref().map(|reduction| &reduction.model)
    }

    /// Names its coordinates; none: they are those of the bodies or joints.
    pub(crate) fn tag(&self) -> Option<u64> {
        self.reduced_model().map(|model| model.tag)
    }

    /// Finds the equilibrium at the end of a path from the parent's in the reduced model. False where the full model has to.
    pub(crate) fn balance_reduced(
        &mut self,
        compiled: &CompiledModel,
        system: &System,
        parent: Option<&Snapshot>,
        path: &dyn LoadPath,
    ) -> bool {
        if self.is_beyond(&self.sources) {
            return false;
        }
        let state = parent.map(|p| state_of(p, self.reduction.is_some()));
        self.stepper.method.begin(state.flatten());
        let Some(reduction) = &mut self.reduction else { return false };
        let Some(method) = self.stepper.method.reduced_now() else { return false };
        let SessionReduction { model, statics, check, .. } = reduction;
        let mut z = vec![0.0; model.space.size()];
        if state.is_some() {
            if state == Some(None) {
                method.project(&self.motion);
            }
            z.copy_from_slice(method.coordinates());
        }
        let mut drive = system.electrics.drive();
        path.at(1.0, &mut drive);
        let tolerance = compiled.options.errors();
        let found = statics.follow(&model.space, path, &mut z).reached >= 1.0
            && method.balance(&z, &drive).is_some_and(|off| tolerance.holds(off))
            && method.excess_now() <= TRAINED
            && {
                let negative = check.of(system, method.bodies(), &drive, None).negative;
                let off = system.model.mass_product(check.step(), check.step()).sqrt();
                negative == 0 && off.is_finite() && tolerance.holds(off / method.largest())
            };
        if found {
            self.motion.q.copy_from_slice(method.bodies());
        }
        found
    }

    /// The sensitivities of that equilibrium.
    pub(crate) fn balance_reduced_ports(&mut self, system: &System) {
        let Some(method) = self.stepper.method.reduced_now() else { return };
        for (p, &port) in self.ports.sources.iter().enumerate() {
            self.unit.fill(0.0);
            self.unit[port] = 1.0;
            system.electrics.steady_slope((&self.sources, &self.rise), &self.unit, &mut self.change);
            method.balance_port(p, &self.drive, &self.change);
        }
        method.place_sensitivities();
    }

    /// Whether a step in the reduced model cannot be used: it failed, or went far beyond the trained motion.
    pub(crate) fn went_far(&self, failed: bool) -> bool {
        let reduced = self.stepper.method.reduced_state();
        reduced.is_some_and(|method| failed || !method.excess_now().is_finite() || method.excess_now() > FAR)
    }

    /// The coordinates that the state after a trial carries; `moves`: of a step.
    pub(crate) fn carried(&mut self, moves: bool) -> Vec<Motion> {
        if self.position.is_some() {
            return Vec::new();
        }
        let drive = &self.drive;
        let Some(method) = self.stepper.method.reduced_now() else {
            return if moves { self.stepper.method.state().to_vec() } else { Vec::new() };
        };
        let mut carried = method.state().to_vec();
        // the states since the equilibrium are counted where accelerations have no rates
        let count = carried.get_mut(1).and_then(|push| push.v.first_mut());
        let due = count.is_none_or(|count| {
            count.x += f64::from(u8::from(moves));
            moves && count.x % EVERY == 1.0
        });
        if method.excess_now() > TRAINED || due && !method.holds(drive) {
            carried.clear();
        }
        carried
    }

    /// Warnings about the reduced model in an accepted state, with their sizes.
    pub(crate) fn reduction_warnings(
        &mut self,
        compiled: &CompiledModel,
        system: &System,
        state: &Snapshot,
    ) -> Vec<(Diagnostic, f64)> {
        // reported after a warning about an error, too
        let mut found: Vec<_> = self.left_warning(compiled, state).into_iter().map(|warning| (warning, LEFT)).collect();
        let mut drive = system.electrics.drive();
        system.electrics.apply(&state.sources, &state.rise, &mut drive);
        self.stepper.method.begin(state_of(state, self.reduction.is_some()));
        if let (Some(reduction), Some(method)) = (&mut self.reduction, self.stepper.method.reduced_now()) {
            let about = (&state.q[..], &state.v[..], &state.carried[..]);
            let error = reduction.seen(system, method, about, (&drive, state.elapsed == 0.0));
            let tol = compiled.options.errors().requested();
            if let Some(text) = beyond(error, tol) {
                let help = "take narrower `ranges`, a smaller `tol`, which adds directions, or `formulation=compliant`";
                found.push((Diagnostic::warning(WARNING, text, help), compiled.options.errors().used(error, 1.0)));
            }
        }
        found
    }

    /// The warning that the full model has taken over.
    fn left_warning(&self, compiled: &CompiledModel, state: &Snapshot) -> Option<Diagnostic> {
        let help = "give `ranges` that hold what the ports are given, or take `formulation=compliant`";
        if let Some(why) = &self.full_because {
            return Some(Diagnostic::warning(WARNING, taken(why), help));
        }
        let reduction = self.reduction.as_ref().filter(|_| !self.is_reduced_state(state))?;
        let text = match reduction.model.beyond(&state.sources) {
            Some((port, given, [low, high])) => {
                let kind = self.ports.kinds[port];
                let (name, unit) = (self.port_name(port, compiled), kind.given().1);
                format!(
                    "port `{name}` is given {given:.4e} {unit}, beyond the range {low:e} to {high:e} {unit} of the reduced model; the full model continues \
                     from here"
                )
            }
            None => "the state is none of those that the reduced model is trained for (pulled in, or a motion beyond its ranges); the full model continues \
                     from here"
                .to_owned(),
        };
        Some(Diagnostic::warning(WARNING, text, help))
    }

    /// Name of an opened port.
    pub(crate) fn port_name(&self, port: usize, compiled: &CompiledModel) -> String {
        match self.opened.ports.get(port) {
            Some(name) => name.clone(),
            None => compiled.parts.system.electrics.names[self.ports.sources[port]].clone(),
        }
    }
}
