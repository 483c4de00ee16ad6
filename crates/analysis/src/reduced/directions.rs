//! Directions that a run in a reduced model leaves for the next run of the same motion.

use bimorph_base::ErrorBudget;
use bimorph_domains::System;
use bimorph_solve::reduced::Training;
use bimorph_solve::reduced::enrichment::{MotionCorrections, enriched};
use std::sync::Arc;

/// Fraction of the strains that a reduced model may have as directions after runs that added some (1), and directions that are always allowed.
const WORTH: f64 = 0.4;
const FEW: usize = 8;

/// The directions of a motion.
#[derive(Debug, Clone)]
pub enum Directions {
    /// Those of a training, and those that the motion lacked.
    Trained {
        /// Them.
        training: Arc<Training>,
        /// The division of the tolerance for polynomials.
        polynomials: ErrorBudget,
    },
    /// The full model, and why it is taken.
    Full(String),
}

impl PartialEq for Directions {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Trained { training: one, polynomials }, Self::Trained { training: other, polynomials: others }) => {
                one.space.directions == other.space.directions && polynomials == others
            }
            (Self::Full(one), Self::Full(other)) => one == other,
            _ => false,
        }
    }
}

impl Directions {
    /// Those for the run after one with these corrections, to a tolerance: in more directions, and with sharper polynomials.
    pub(super) fn after(&self, system: &System, corrections: &MotionCorrections, errors: ErrorBudget) -> Self {
        let Self::Trained { training, polynomials } = self else { return self.clone() };
        let polynomials = polynomials.next_polynomials();
        let Some(more) = enriched(training, system, corrections, errors) else {
            return Self::Trained { training: Arc::clone(training), polynomials };
        };
        let (directions, strains) = (more.space.size(), more.space.joints.tree.coordinates);
        if directions > ((WORTH * strains as f64) as usize).max(FEW).min(strains) {
            return Self::Full(format!("its motion takes {directions} directions of {strains} strains"));
        }
        Self::Trained { training: Arc::new(more), polynomials }
    }

    /// Whether the full model is taken.
    pub(crate) fn are_all(&self) -> bool {
        matches!(self, Self::Full(_))
    }
}
