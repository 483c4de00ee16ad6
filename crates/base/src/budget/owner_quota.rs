//! Quota that all computations of one owner share: bytes in use, and processor time within an hour.
//!
//! Processor time follows a leaky bucket (J. Turner, 1986): used time drains at a constant rate, the whole allowance in
//! an hour.

use super::Stopped;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time in which the allowance of processor time comes back.
pub const WINDOW: Duration = Duration::from_secs(3600);

/// Quota shared by several computations.
#[derive(Debug)]
pub struct OwnerQuota {
    /// Most bytes that they lay out at once; none: any.
    bytes: Option<usize>,
    /// Most processor time within [`WINDOW`]; none: any.
    cpu: Option<Duration>,
    laid_out: AtomicUsize,
    spent: Mutex<UsageBucket>,
}

/// Processor time that has not flowed out yet.
#[derive(Debug)]
struct UsageBucket {
    seconds: f64,
    at: Instant,
}

impl OwnerQuota {
    /// With so much in it; none: any.
    #[inline]
    pub fn new(bytes: Option<usize>, cpu: Option<Duration>) -> Self {
        let spent = Mutex::new(UsageBucket { seconds: 0.0, at: Instant::now() });
        Self { bytes, cpu, laid_out: AtomicUsize::new(0), spent }
    }

    /// Takes bytes.
    ///
    /// # Errors
    /// [`Stopped::OwnerBytes`]; nothing is taken then.
    #[inline]
    pub fn take(&self, bytes: usize) -> Result<(), Stopped> {
        let Some(most) = self.bytes else { return Ok(()) };
        let used = self.laid_out.fetch_add(bytes, Ordering::Relaxed);
        if used.saturating_add(bytes) <= most {
            return Ok(());
        }
        self.laid_out.fetch_sub(bytes, Ordering::Relaxed);
        Err(Stopped::OwnerBytes { most, used, more: bytes })
    }

    /// Gives bytes back that were taken.
    #[inline]
    pub fn give_back(&self, bytes: usize) {
        if self.bytes.is_some() {
            self.laid_out.fetch_sub(bytes, Ordering::Relaxed);
        }
    }

    /// Takes processor time that was used.
    #[inline]
    pub fn charge_cpu(&self, time: Duration) {
        self.spend_at(Instant::now(), time);
    }

    fn spend_at(&self, now: Instant, time: Duration) {
        let Some(most) = self.cpu else { return };
        let mut spent = self.spent.lock().unwrap_or_else(PoisonError::into_inner);
        let flowed = now.saturating_duration_since(spent.at).as_secs_f64() * most.as_secs_f64() / WINDOW.as_secs_f64();
        spent.seconds = (spent.seconds - flowed).max(0.0) + time.as_secs_f64();
        spent.at = now;
    }

    /// Whether there is processor time left.
    ///
    /// # Errors
    /// [`Stopped::OwnerCpu`].
    #[inline]
    pub fn check_cpu(&self) -> Result<(), Stopped> {
        self.solvent_at(Instant::now())
    }

    fn solvent_at(&self, now: Instant) -> Result<(), Stopped> {
        let Some(most) = self.cpu else { return Ok(()) };
        self.spend_at(now, Duration::ZERO);
        let spent = self.spent.lock().unwrap_or_else(PoisonError::into_inner).seconds;
        if spent < most.as_secs_f64() {
            return Ok(());
        }
        Err(Stopped::OwnerCpu { most, used: Duration::from_secs_f64(spent.min(1e15)) })
    }
}

#[cfg(test)]
mod tests {
    //! Reservations are bounded, released amounts can be reserved again, and time is restored at a constant rate.
    use super::*;

    #[test]
    fn bytes_are_those_of_all() {
        let purse = OwnerQuota::new(Some(100), None);
        assert_eq!(purse.take(60), Ok(()));
        assert_eq!(purse.take(41), Err(Stopped::OwnerBytes { most: 100, used: 60, more: 41 }));
        assert_eq!(purse.take(40), Ok(()));
        purse.give_back(60);
        assert_eq!(purse.take(60), Ok(()));
        assert_eq!(OwnerQuota::new(None, None).take(usize::MAX), Ok(()));
    }

    #[test]
    fn time_comes_back_within_the_window() {
        let most = Duration::from_secs(360);
        let purse = OwnerQuota::new(None, Some(most));
        let start = Instant::now();
        let after = |seconds| start + Duration::from_secs(seconds);
        purse.spend_at(start, Duration::from_secs(350));
        assert_eq!(purse.solvent_at(start), Ok(()));
        purse.spend_at(start, Duration::from_secs(30));
        let Err(Stopped::OwnerCpu { used, .. }) = purse.solvent_at(start) else { panic!("it is used up") };
        // only a moment has passed between the creation of the quota and the start
        assert!((used.as_secs_f64() - 380.0).abs() < 1e-3, "{used:?}");
        // 360 s come back in an hour, one in ten seconds: 20 in 200
        assert!(purse.solvent_at(after(199)).is_err());
        assert_eq!(purse.solvent_at(after(201)), Ok(()));
        purse.spend_at(after(201), Duration::from_secs(1));
        assert!(purse.solvent_at(after(201)).is_err());
        assert_eq!(purse.solvent_at(after(4000)), Ok(()));
        purse.spend_at(after(4000), most - Duration::from_secs(1));
        assert_eq!(purse.solvent_at(after(4000)), Ok(()), "no more comes back than was used");
    }
}
