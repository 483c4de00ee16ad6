//! What a computation may use.

use super::Purse;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What a computation may use.
#[derive(Debug, Clone)]
pub struct Allowance {
    /// Bytes that it may lay out, all together.
    pub bytes: usize,
    /// Mechanical unknowns of a model that it makes.
    pub unknowns: usize,
    /// Processor time of each of its threads; none: any.
    pub cpu: Option<Duration>,
    /// When it must have ended; none: any time.
    pub deadline: Option<Instant>,
    /// What it draws on together with others; none: nothing.
    pub purse: Option<Arc<Purse>>,
}

impl Default for Allowance {
    fn default() -> Self {
        Self { bytes: usize::MAX, unknowns: usize::MAX, cpu: None, deadline: None, purse: None }
    }
}

impl Allowance {
    /// Whether processor time is looked at.
    pub(super) fn counts_cpu(&self) -> bool {
        self.cpu.is_some() || self.purse.is_some()
    }
}
