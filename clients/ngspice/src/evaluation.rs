//! Evaluation requests of ngspice to an instance, and their outcomes.

use crate::companion::DifferentiationRule;
use crate::history::Base;
use bimorph::device::{Token, TrialReply};

/// Evaluation request of ngspice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EvaluationRequest {
    /// Operating point or sweep: equilibrium.
    Static,
    /// A step of `dt` (s) that ends at `t` (s).
    Transient {
        /// End of the step (s).
        t: f64,
        /// Length (s), positive.
        dt: f64,
        /// How charges are differentiated over it.
        rule: DifferentiationRule,
    },
    /// Small-signal answer at `omega` (rad/s).
    SmallSignal {
        /// Angular frequency (rad/s).
        omega: f64,
    },
}

/// Outcome of an evaluation.
#[derive(Debug, Clone, PartialEq)]
pub enum EvaluationOutcome {
    /// The instance holds the answer.
    Solved,
    /// No answer for this step: ngspice shall try a shorter one, or another way to the operating point.
    Retry,
    /// The analysis must end; the text says why.
    Stop(String),
}

/// Currents, conductances and monitors for ngspice. p ports, s monitors; matrices row-major.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Evaluation {
    /// State reached.
    pub token: Option<Token>,
    /// Step that led to it (s); 0 for equilibrium.
    pub step: f64,
    /// Current into each port (A), or the voltage across one whose current is given (V) (p).
    pub currents: Vec<f64>,
    /// ∂current/∂voltage (S), or of what else is answered and given (p×p).
    pub conductances: Vec<f64>,
    /// Charges (C) (p).
    pub charges: Vec<f64>,
    /// Base for differentiating the next step's charges, if this point is accepted.
    pub base: Base,
    /// By how much a current changes with its charge over this step (1/s); 0 for equilibrium.
    pub slope: f64,
    /// Scaled monitors (V) (s).
    pub monitors: Vec<f64>,
    /// ∂monitor/∂voltage (1) (s×p).
    pub monitor_gains: Vec<f64>,
}

impl Evaluation {
    /// Takes a reply over, its charges as currents where time passes: by a rule, to t (s), over a step (s), from what the point before has
    /// left.
    pub(crate) fn take(&mut self, reply: &TrialReply, time: Option<(DifferentiationRule, f64, f64)>, base: &Base) {
        self.token = reply.token;
        (self.step, self.slope) = (time.map_or(0.0, |(.., dt)| dt), 0.0);
        self.charges.clone_from(&reply.charges);
        self.currents.clone_from(&reply.currents);
        self.conductances.clone_from(&reply.di_dv);
        self.base.clone_from(base);
        if let Some((rule, t, dt)) = time {
            self.slope = self.base.advance(rule, (t, dt), &reply.charges, &mut self.currents);
            for (g, c) in self.conductances.iter_mut().zip(&reply.dq_dv) {
                *g += self.slope * c;
            }
        } else {
            self.base.start(&reply.charges);
        }
    }
}
