//! Limits of a computation.

use super::{OwnerQuota, Stopped};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Limits of a computation.
#[derive(Debug, Clone)]
pub struct Allowance {
    /// Bytes that it may lay out, all together.
    pub bytes: usize,
    /// Mechanical unknowns of a model that it makes.
    pub unknowns: usize,
    /// Unknowns times the square of the modes that are sought of a model.
    pub mode_work: usize,
    /// Processor time of each of its threads; none: any.
    pub cpu: Option<Duration>,
    /// When it must have ended; none: any time.
    pub deadline: Option<Instant>,
    /// Quota that it shares with others; `None`: no quota.
    pub purse: Option<Arc<OwnerQuota>>,
}

impl Default for Allowance {
    fn default() -> Self {
        Self { bytes: usize::MAX, unknowns: usize::MAX, mode_work: usize::MAX, cpu: None, deadline: None, purse: None }
    }
}

impl Allowance {
    /// Whether so many modes of a model may be sought. Its `unknowns` are evaluated only where those of the largest
    /// would be too many.
    pub(super) fn modes(&self, count: usize, unknowns: impl FnOnce() -> usize) -> Result<(), Stopped> {
        let most = self.mode_work;
        let work = |unknowns: usize| unknowns.saturating_mul(count.saturating_mul(count));
        if most == usize::MAX || work(self.unknowns) <= most {
            return Ok(());
        }
        let got = work(unknowns());
        if got > most { Err(Stopped::ModeWork { most, got }) } else { Ok(()) }
    }

    /// Whether processor time is limited.
    pub(super) fn counts_cpu(&self) -> bool {
        self.cpu.is_some() || self.purse.is_some()
    }
}
