//! Rodas4 in the formulation of a model: a circuit, a service or a sweep steps a mechanism without asking which it is.

use super::joint_rodas4::JointRodas4;
use super::method::{Method, Motion, SolverCounters, StepResult};
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

    /// ∂(bodies' motion)/∂(final voltage), one for each source.
    pub fn sensitivity(&self) -> &[Motion] {
        match self {
            Self::Bodies(m) => &m.sensitivity,
            Self::Joints(m) => &m.sensitivity,
        }
    }

    /// As above, to be filled after an equilibrium search.
    pub fn sensitivity_mut(&mut self) -> &mut [Motion] {
        match self {
            Self::Bodies(m) => &mut m.sensitivity,
            Self::Joints(m) => &mut m.sensitivity,
        }
    }

    /// A motion begins that depends on no voltage yet. `state` is the result of [`Formulated::state`] at its beginning;
    /// empty where only the bodies' motion is known.
    pub fn begin(&mut self, state: &[Motion]) {
        match self {
            Self::Bodies(m) => m.sensitivity.iter_mut().for_each(Motion::clear),
            Self::Joints(m) => {
                m.forget_sensitivities();
                if !state.is_empty() {
                    m.resume(state);
                }
            }
        }
    }

    /// State for the next step beside the bodies' motion.
    pub fn state(&self) -> &[Motion] {
        match self {
            Self::Bodies(_) => &[],
            Self::Joints(m) => m.state(),
        }
    }
}

impl Method<Bodies<'_>> for Formulated {
    fn error_order(&self) -> f64 {
        match self {
            Self::Bodies(m) => Method::<Bodies<'_>>::error_order(&**m),
            Self::Joints(m) => Method::<Bodies<'_>>::error_order(&**m),
        }
    }

    fn start(&mut self, bodies: &mut Bodies<'_>, motion: &Motion) -> StepResult {
        match self {
            Self::Bodies(m) => m.start(bodies, motion),
            Self::Joints(m) => m.start(bodies, motion),
        }
    }

    fn step(&mut self, bodies: &mut Bodies<'_>, s: f64, h: f64, motion: &mut Motion, error: &mut Motion) -> StepResult {
        match self {
            Self::Bodies(m) => m.step(bodies, s, h, motion, error),
            Self::Joints(m) => m.step(bodies, s, h, motion, error),
        }
    }

    fn carried(&mut self) -> &mut [Motion] {
        match self {
            Self::Bodies(m) => m.carried(),
            Self::Joints(m) => m.carried(),
        }
    }

    fn work(&self) -> SolverCounters {
        match self {
            Self::Bodies(m) => m.work(),
            Self::Joints(m) => m.work(),
        }
    }
}
