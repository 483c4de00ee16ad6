//! Rodas4 in the formulation of a model: a circuit, a service or a sweep steps a mechanism without asking which it is.

use super::joint_rodas4::JointRodas4;
use super::method::{Method, Motion, SolverCounters, StepResult};
use super::reduced_rodas4::ReducedRodas4;
use super::rodas4::Rodas4;
use crate::equations::{Bodies, Joints};
use bimorph_domains::System;
use std::sync::Arc;

/// The method in one of the formulations; one comparison a step.
#[derive(Debug, Clone)]
pub enum Formulated {
    /// Every body has its own coordinates.
    Bodies(Box<Rodas4>),
    /// Relative joint coordinates.
    Joints(Box<JointRodas4>),
    /// A reduced model, or every body's own coordinates where a motion has left what that was trained for.
    Reduced(Box<ReducedOrBodies>),
}

/// A reduced model with the full one, which takes over where it has to.
#[derive(Debug, Clone)]
pub struct ReducedOrBodies {
    /// The reduced model.
    pub reduced: ReducedRodas4,
    bodies: Rodas4,
    /// Whether the reduced model steps.
    pub is_reduced: bool,
}

impl Formulated {
    /// With sensitivities to the final voltages of `sources`, in joint coordinates where the model has them. `shortest` is
    /// about the shortest time in which something moves (s).
    pub fn new(system: &System, joints: Option<&Arc<Joints>>, shortest: f64, sources: &[usize]) -> Self {
        match joints {
            Some(joints) => Self::Joints(Box::new(JointRodas4::new(Arc::clone(joints), shortest, sources))),
            None => Self::Bodies(Box::new(Rodas4::new(system, sources))),
        }
    }

    /// With a reduced model that has its sensitivities, and the full one beside it.
    pub fn reduced(reduced: ReducedRodas4, system: &System, sources: &[usize]) -> Self {
        let bodies = Rodas4::new(system, sources);
        Self::Reduced(Box::new(ReducedOrBodies { reduced, bodies, is_reduced: true }))
    }

    /// The reduced model, where it steps.
    pub fn reduced_now(&mut self) -> Option<&mut ReducedRodas4> {
        match self {
            Self::Reduced(m) if m.is_reduced => Some(&mut m.reduced),
            _ => None,
        }
    }

    /// The same, to be read.
    pub fn reduced_state(&self) -> Option<&ReducedRodas4> {
        match self {
            Self::Reduced(m) if m.is_reduced => Some(&m.reduced),
            _ => None,
        }
    }

    /// The full model steps from here on; the motion begins anew.
    pub fn take_bodies(&mut self) {
        if let Self::Reduced(m) = self {
            m.is_reduced = false;
        }
        self.begin(Some(&[]));
    }

    /// ∂(bodies' motion)/∂(final voltage), one for each source.
    pub fn sensitivity(&self) -> &[Motion] {
        match self {
            Self::Bodies(m) => &m.sensitivity,
            Self::Joints(m) => &m.sensitivity,
            Self::Reduced(m) if m.is_reduced => m.reduced.sensitivity(),
            Self::Reduced(m) => &m.bodies.sensitivity,
        }
    }

    /// As above, to be filled after an equilibrium search.
    pub fn sensitivity_mut(&mut self) -> &mut [Motion] {
        match self {
            Self::Bodies(m) => &mut m.sensitivity,
            Self::Joints(m) => &mut m.sensitivity,
            Self::Reduced(m) => match m.is_reduced {
                true => m.reduced.sensitivity_mut(),
                false => &mut m.bodies.sensitivity,
            },
        }
    }

    /// A motion begins that depends on no voltage yet. `state` is the result of [`Formulated::state`] at its beginning: empty where only the bodies'
    /// motion is known, none where it begins at rest as drawn.
    pub fn begin(&mut self, state: Option<&[Motion]>) {
        match self {
            Self::Bodies(m) => m.sensitivity.iter_mut().for_each(Motion::clear),
            Self::Joints(m) => {
                m.forget_sensitivities();
                if let Some(state @ [_, ..]) = state {
                    m.resume(state);
                }
            }
            Self::Reduced(m) => {
                m.is_reduced = state.is_none_or(|state| !state.is_empty());
                match m.is_reduced {
                    true => m.reduced.resume(state),
                    false => m.bodies.sensitivity.iter_mut().for_each(Motion::clear),
                }
            }
        }
    }

    /// Makes the sensitivities those of the bodies at the end of the steps taken.
    pub fn place_sensitivities(&mut self) {
        if let Some(reduced) = self.reduced_now() {
            reduced.place_sensitivities();
        }
    }

    /// Whether a motion can be moved along its sensitivities ([`Formulated::move_by`]): that of every body's own coordinates, and that of a reduced model.
    pub fn has_linear_trials(&self) -> bool {
        !matches!(self, Self::Joints(_))
    }

    /// Whether sensitivities take the tangent at the start of a step for all its stages ([`Rodas4::first_tangent`]).
    pub fn keep_first_tangent(&mut self, keep: bool) {
        match self {
            Self::Bodies(m) => m.first_tangent = keep,
            Self::Joints(_) => {}
            Self::Reduced(m) => {
                m.bodies.first_tangent = keep;
                m.reduced.keep_first_tangent(keep);
            }
        }
    }

    /// State that the method carries from step to step, with the sensitivities.
    pub fn all_carried(&mut self) -> &[Motion] {
        Method::<Bodies<'_>>::carried(self)
    }

    /// Takes the motion of the bodies to the end `from` of a step, after which `carried` was carried, moved by its sensitivities times changes of the sources.
    pub fn move_by(
        &mut self,
        carried: &[Motion],
        (from, sensitivities): (&Motion, &[Motion]),
        changes: &[f64],
        motion: &mut Motion,
    ) {
        if let Some(reduced) = self.reduced_now() {
            reduced.move_by(carried, changes);
        }
        motion.copy(from);
        for (s, change) in sensitivities.iter().zip(changes) {
            motion.add(*change, s);
        }
        self.sensitivity_mut().iter_mut().zip(sensitivities).for_each(|(to, s)| to.copy(s));
    }

    /// State for the next step beside the bodies' motion.
    pub fn state(&self) -> &[Motion] {
        match self {
            Self::Reduced(m) if !m.is_reduced => &[],
            _ => self.layout(),
        }
    }

    /// A state of the sizes that one has; of a reduced model it may also be empty.
    pub fn layout(&self) -> &[Motion] {
        match self {
            Self::Bodies(_) => &[],
            Self::Joints(m) => m.state(),
            Self::Reduced(m) => m.reduced.state(),
        }
    }
}

impl Method<Bodies<'_>> for Formulated {
    fn error_order(&self) -> f64 {
        match self {
            Self::Bodies(m) => Method::<Bodies<'_>>::error_order(&**m),
            Self::Joints(m) => Method::<Bodies<'_>>::error_order(&**m),
            Self::Reduced(m) => Method::<Bodies<'_>>::error_order(&m.reduced),
        }
    }

    fn start(&mut self, bodies: &mut Bodies<'_>, motion: &Motion) -> StepResult {
        match self {
            Self::Bodies(m) => m.start(bodies, motion),
            Self::Joints(m) => m.start(bodies, motion),
            Self::Reduced(m) if m.is_reduced => m.reduced.start(bodies, motion),
            Self::Reduced(m) => m.bodies.start(bodies, motion),
        }
    }

    fn step(&mut self, bodies: &mut Bodies<'_>, s: f64, h: f64, motion: &mut Motion, error: &mut Motion) -> StepResult {
        match self {
            Self::Bodies(m) => m.step(bodies, s, h, motion, error),
            Self::Joints(m) => m.step(bodies, s, h, motion, error),
            Self::Reduced(m) if m.is_reduced => m.reduced.step(bodies, s, h, motion, error),
            Self::Reduced(m) => m.bodies.step(bodies, s, h, motion, error),
        }
    }

    fn accepted(&mut self, bodies: &mut Bodies<'_>, step: (f64, f64), ends: [&Motion; 2], carried: &[Motion]) {
        if let Some(reduced) = self.reduced_now() {
            reduced.accepted(bodies, step, ends, carried);
        }
    }

    fn carried(&mut self) -> &mut [Motion] {
        match self {
            Self::Bodies(m) => m.carried(),
            Self::Joints(m) => m.carried(),
            Self::Reduced(m) => match m.is_reduced {
                true => m.reduced.carried(),
                false => m.bodies.carried(),
            },
        }
    }

    fn work(&self) -> SolverCounters {
        match self {
            Self::Bodies(m) => m.work(),
            Self::Joints(m) => m.work(),
            Self::Reduced(m) if m.is_reduced => m.reduced.work(),
            Self::Reduced(m) => m.bodies.work(),
        }
    }
}
