//! A trained model for motions of one system, which runs share.

use bimorph_base::ErrorBudget;
use bimorph_domains::System;
use bimorph_solve::reduced::polynomial::moving::FittedMotion;
use bimorph_solve::reduced::{ReducedSpace, Training};
use bimorph_solve::time::reduced_rodas4::ReducedRodas4;
use std::sync::Arc;

/// A reduced model for motions of one system. Immutable.
#[derive(Debug, Clone)]
pub struct MotionReduction {
    /// The space of the system.
    pub space: Arc<ReducedSpace>,
    /// The training of the space.
    pub training: Arc<Training>,
    /// Forces as polynomials, where these are within their part of the tolerance.
    pub fitted: Option<FittedMotion>,
    /// The division of the tolerance for them.
    pub polynomials: ErrorBudget,
}

/// A training, or why motions take the full model.
pub type TrainedMotion = Result<MotionReduction, String>;

impl MotionReduction {
    /// The method for a run of the system; `shortest` is about the shortest time in which something moves (s).
    pub(crate) fn method(&self, system: &System, shortest: f64) -> ReducedRodas4 {
        let method = ReducedRodas4::new(Arc::clone(&self.space), shortest).with_estimate(system);
        let share = self.polynomials.reduced_statics();
        match &self.fitted {
            Some(fitted) => method.with_polynomials(fitted.polynomials.clone(), share, fitted.largest),
            None => method,
        }
    }
}
