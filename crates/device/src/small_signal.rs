//! The small-signal answer: how ports and signals of a state respond to a small change at one port that goes as e^(st).
//!
//! [`PerturbedState`] is the physics at any complex s (rad/s); [`DeviceSession::respond`] asks at s = iω.

use super::session::DeviceSession;
use super::states::Snapshot;
use super::{DeviceError, SmallSignal, Token};
use bimorph_analysis::readout::ports::PortResponse;
use bimorph_analysis::readout::small_signal::{ForcedMotion, PerturbedState};
use bimorph_domains::System;
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::BodyMatrix;
use bimorph_solve::frequency::gyroscopic;
use nalgebra::Complex;

impl DeviceSession {
    /// Sets the drive of a state and factors the dynamic stiffness about it.
    pub(super) fn factor_about(
        &mut self,
        system: &System,
        token: Token,
        state: &Snapshot,
        omega: f64,
    ) -> Result<(), DeviceError> {
        system.electrics.apply(&state.sources, &state.rise, &mut self.drive);
        if self.linear.as_ref().is_none_or(|(t, _)| *t != token) {
            let mut tangent = BodyMatrix::new(&system.model.pattern);
            system.tangent(&state.q, &self.drive, &mut tangent, &mut self.motion.q);
            self.harmonic.about(system, &state.q);
            self.linear = Some((token, tangent));
        }
        let Some((_, tangent)) = &self.linear else { return Err(DeviceError::NotOpen) };
        self.harmonic.factor(system, tangent, omega).map_err(|e| DeviceError::BadRequest {
            what: "omega",
            expected: "a frequency away from an undamped resonance".into(),
            got: format!("{omega:e} rad/s ({e})"),
        })
    }

    /// Small-signal response about a state.
    pub(super) fn respond(
        &mut self,
        compiled: &CompiledModel,
        token: Token,
        state: &Snapshot,
        omega: f64,
        reply: &mut SmallSignal,
    ) -> Result<(), DeviceError> {
        let own = self.ports.system.clone();
        let system = Self::system(&own, compiled);
        self.factor_about(system, token, state, omega)?;
        let rate = system.frame(&self.drive).map_or(0.0, |frame| frame.rate);
        let ports = self.ports.len();
        reply.admittance.clear();
        reply.admittance.resize(ports * ports, [0.0; 2]);
        reply.outputs.clear();
        reply.outputs.resize(self.signals.len() * ports, [0.0; 2]);
        let (q, v, rise, sources) = (&state.q, &state.v, &state.rise, &state.sources);
        let about = PerturbedState { compiled, system, q, v, rise, sources, drive: &self.drive };
        let s = Complex::new(0.0, omega);
        let pair = |c: Complex<f64>| [c.re, c.im];
        for (p, &port) in self.ports.sources.iter().enumerate() {
            let push = about.push(port, s);
            self.response.copy_from_slice(&push.force);
            gyroscopic::solve(&mut self.harmonic, system, (omega, rate), &mut self.response);
            let moved = ForcedMotion::new(&push, &self.response, s);
            for (row, signal) in self.signals.iter().enumerate() {
                reply.outputs[row * ports + p] = pair(signal.sum(|one| about.signal_change(*one, &moved)));
            }
            let charges = about.charges(&self.ports.sources, &moved);
            for (row, (answer, &other)) in self.ports.answers.iter().zip(&self.ports.sources).enumerate() {
                reply.admittance[row * ports + p] = match answer {
                    // i = G + s·dq
                    PortResponse::Current => pair(s * charges[row] + push.currents[other]),
                    PortResponse::Motion(signal) => pair(about.signal_change(*signal, &moved)),
                    PortResponse::Rise(heater) => pair(PerturbedState::warmed(&push, *heater)),
                    PortResponse::Nothing => [0.0; 2],
                };
            }
        }
        Ok(())
    }
}
