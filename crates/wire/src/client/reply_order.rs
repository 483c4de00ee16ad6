//! Whether replies to trials come in the order of the trials, as far as that shows: a state has one name and comes of one trial.

use bimorph_device::{Mode, Status, Token, Trial, TrialReply};

/// Trials in a row that may require a shorter step. Each requires less than it was given, and devices much less.
const SHORTENED: usize = 500;

/// The trials of a stream so far.
#[derive(Debug, Default)]
pub(super) struct TrialOrder {
    /// The last trial with a state, and the name of that.
    last: Option<(PendingTrial, Token)>,
    /// Trials in a row that required a shorter step.
    shortened: usize,
}

/// A trial, as it was asked.
#[derive(Debug, PartialEq)]
struct PendingTrial {
    mode: Mode,
    parent: Option<Token>,
    dt: u64,
    voltages: Vec<u64>,
}

impl PendingTrial {
    fn of(trial: &Trial<'_>) -> Self {
        let voltages = trial.voltages.iter().map(|volts| volts.to_bits()).collect();
        let dt = if trial.mode == Mode::Static { 0 } else { trial.dt.to_bits() };
        Self { mode: trial.mode, parent: trial.parent, dt, voltages }
    }
}

impl TrialOrder {
    /// Checks the reply to the next trial.
    ///
    /// # Errors
    /// A reply to an earlier trial; steps that become shorter without end.
    pub(super) fn check(&mut self, trial: &Trial<'_>, reply: &TrialReply) -> Result<(), String> {
        self.shortened = if matches!(reply.status, Status::NeedDt(_)) { self.shortened + 1 } else { 0 };
        if self.shortened > SHORTENED {
            return Err(format!("need_dt: {SHORTENED} trials in a row required a shorter step"));
        }
        let Some(token) = reply.token else { return Ok(()) };
        let asked = PendingTrial::of(trial);
        if self.last.as_ref().is_some_and(|(other, before)| *before == token && *other != asked) {
            return Err("it names the state of an earlier trial".to_owned());
        }
        self.last = Some((asked, token));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    //! The same trial may be asked again; the reply to another one shows.
    use super::*;

    #[test]
    fn replies_to_earlier_trials_show() {
        let mut order = TrialOrder::default();
        let trial = |volts| Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: volts };
        let reply = |token| TrialReply { token: Some(Token(token)), status: Status::Ok, ..TrialReply::default() };
        assert_eq!(order.check(&trial(&[1.0]), &reply(5)), Ok(()));
        assert_eq!(order.check(&trial(&[1.0]), &reply(5)), Ok(()));
        assert_eq!(order.check(&trial(&[2.0]), &reply(6)), Ok(()));
        assert!(order.check(&trial(&[3.0]), &reply(6)).is_err());
        let need = TrialReply { token: None, status: Status::NeedDt(1.0), ..TrialReply::default() };
        assert!((0..SHORTENED).all(|_| order.check(&trial(&[3.0]), &need).is_ok()));
        assert!(order.check(&trial(&[3.0]), &need).is_err());
    }
}
