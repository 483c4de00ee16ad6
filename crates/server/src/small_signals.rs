//! Small-signal answers of a session, and how large they may be.

use super::limits::Limits;
use super::session::Session;
use super::small_signal::small_signal;
use super::status;
use super::work::caught;
use bimorph_base::budget::{self, Allowance, Budget};
use bimorph_device::{Device, Token};
use bimorph_wire::proto;
use std::sync::PoisonError;
use tonic::Status;

impl Session {
    /// Small-signal answers at several frequencies, for the unary call, which runs under a budget of its own.
    pub(super) fn linearize(
        &self,
        token: Token,
        omega: &[f64],
        noise: bool,
    ) -> Result<Vec<proto::SmallSignal>, Status> {
        self.usage.touch();
        let mut device = self.device.lock().unwrap_or_else(PoisonError::into_inner);
        let budget = budget::current().unwrap_or_else(|| Budget::new(Allowance::default()));
        let one = |&omega: &f64, device: &mut dyn Device| small_signal(device, token, omega, noise);
        match caught(&budget, || omega.iter().map(|omega| one(omega, device.as_mut())).collect::<Result<_, _>>()) {
            Some(Ok(answer)) => answer.map_err(|error| status::device(&error)),
            Some(Err(why)) => {
                // what was stopped may not stop this as well
                let free = Budget::new(Allowance::default());
                match caught(&free, || device.recover()) {
                    Some(Ok(())) => {}
                    _ => self.fault(),
                }
                Err(status::stopped(why))
            }
            None => {
                self.fault();
                Err(status::fault())
            }
        }
    }

    /// Checks that so many small-signal answers make a message that may be sent.
    ///
    /// # Errors
    /// RESOURCE_EXHAUSTED.
    pub(super) fn bound_small_signals(&self, count: usize, noise: bool, limits: &Limits) -> Result<(), Status> {
        /// Size of a reply besides its numbers.
        const HEAD: usize = 64;
        let (ports, signals) = {
            let opened = self.description.lock().unwrap_or_else(PoisonError::into_inner);
            (opened.ports.len(), opened.signals.len())
        };
        let answers = ports + signals;
        let numbers = answers.saturating_mul(if noise { answers } else { ports });
        let bytes = count.saturating_mul(numbers.saturating_mul(2 * size_of::<f64>()).saturating_add(HEAD));
        if bytes > limits.message_bytes {
            let got = format!("{bytes} for {count} small-signal answers of {ports} ports and {signals} signals");
            return Err(status::limit("message_bytes", limits.message_bytes, got));
        }
        Ok(())
    }
}
