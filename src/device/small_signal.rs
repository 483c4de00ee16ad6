//! The small-signal answer: how ports and signals of a state respond to a small sinusoid at one port.

use super::local::Session;
use super::ports::Answer;
use super::states::Snapshot;
use super::{DeviceError, SmallSignal, Token};
use crate::analysis::signal::View;
use crate::compile::Compiled;
use crate::gaps::System;
use crate::multibody::BlockMatrix;
use crate::multibody::planar::Pose;
use crate::solve::frequency::gyroscopic;
use crate::solve::time::gyration::{held_out, skew};

impl Session {
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
            let mut tangent = BlockMatrix::new(&system.model.pattern);
            system.tangent(&state.q, &self.drive, &mut tangent, &mut self.motion.q);
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
        compiled: &Compiled,
        token: Token,
        state: &Snapshot,
        omega: f64,
        reply: &mut SmallSignal,
    ) -> Result<(), DeviceError> {
        let own = self.ports.system.clone();
        let system = Self::system(&own, compiled);
        let electrics = &system.electrics;
        self.factor_about(system, token, state, omega)?;
        let rate = system.frame(&self.drive).map_or(0.0, |frame| frame.rate);
        let (ports, gaps, heaters) = (self.ports.len(), self.drive.volts.len(), state.rise.len());
        reply.admittance.clear();
        reply.admittance.resize(ports * ports, [0.0; 2]);
        reply.outputs.clear();
        reply.outputs.resize(self.signals.len() * ports, [0.0; 2]);
        let view = View { q: &state.q, v: &state.v, rise: &state.rise, volts: &self.drive.volts };
        for (p, &port) in self.ports.sources.iter().enumerate() {
            self.unit.fill(0.0);
            self.unit[port] = 1.0;
            // heaters lag: δT = (2Qu·δV + Z·δW)/(1 + iωτ)
            let rise: Vec<[f64; 2]> = (0..heaters)
                .map(|k| {
                    let steady = electrics.heating.slope(k, &state.sources, &self.unit);
                    let x = omega * electrics.heating.heaters[k].time_constant;
                    [steady / (1.0 + x * x), -steady * x / (1.0 + x * x)]
                })
                .collect();
            let gap_row: Vec<f64> = (0..gaps).map(|g| electrics.gap_rows[(g, port)]).collect();
            let still = vec![0.0; gaps];
            let turns = system.is_rate(port);
            let parts = [0, 1].map(|part| {
                let mut change = electrics.drive();
                change.volts.copy_from_slice(if part == 0 { &gap_row } else { &still });
                for ((strain, heater), rise) in change.expansion.iter_mut().zip(&electrics.heating.heaters).zip(&rise) {
                    *strain = heater.expansion * rise[part];
                }
                change.load = 0.0;
                // the rate of the frame changes by iω for each unit of it
                match part {
                    0 => change.inputs.copy_from_slice(&self.unit[electrics.voltages()..]),
                    _ if turns => change.turning = omega,
                    _ => {}
                }
                let mut force = self.zeros.clone();
                system.drive_force(&state.q, &self.drive, &change, &mut force);
                if turns && part == 0 {
                    // Coriolis' force of the motion that the state has
                    for ((force, body), v) in force.iter_mut().zip(&system.model.bodies).zip(&state.v) {
                        *force += held_out(body, skew(body, 2.0, v));
                    }
                }
                force
            });
            for ((x, re), im) in self.response.iter_mut().zip(&parts[0]).zip(&parts[1]) {
                *x = re.zip_map(im, |re, im| nalgebra::Complex::new(-re, -im));
            }
            gyroscopic::solve(&mut self.harmonic, system, (omega, rate), &mut self.response);
            for part in 0..2 {
                let q: Vec<Pose> =
                    self.response.iter().map(|x| x.map(|c| if part == 0 { c.re } else { c.im })).collect();
                // rates are iω times displacements
                let v: Vec<Pose> = (self.response.iter())
                    .map(|x| x.map(|c| if part == 0 { -omega * c.im } else { omega * c.re }))
                    .collect();
                let volts = if part == 0 { &gap_row } else { &still };
                let warm: Vec<f64> = rise.iter().map(|r| r[part]).collect();
                for (g, volts) in volts.iter().enumerate() {
                    let dq =
                        system.capacitance(g, view.q) * volts + system.capacitance_slope(g, view.q, &q) * view.volts[g];
                    for (row, &other) in self.ports.sources.iter().enumerate() {
                        if self.ports.answers[row] != Answer::Current {
                            continue;
                        }
                        let y = &mut reply.admittance[row * ports + p];
                        // i = iω·dq
                        let current = omega * electrics.gap_rows[(g, other)] * dq;
                        if part == 0 { y[1] += current } else { y[0] -= current }
                    }
                }
                let change = View { q: &q, v: &v, rise: &warm, volts };
                for (row, signal) in self.signals.iter().enumerate() {
                    reply.outputs[row * ports + p][part] = signal.slope(compiled, &view, &change);
                }
                for (row, answer) in self.ports.answers.iter().enumerate() {
                    match answer {
                        Answer::Motion(signal) => {
                            reply.admittance[row * ports + p][part] = signal.slope(compiled, &view, &change);
                        }
                        Answer::Rise(heater) => reply.admittance[row * ports + p][part] = change.rise[*heater],
                        Answer::Current | Answer::Nothing => {}
                    }
                }
            }
            for (row, &other) in self.ports.sources.iter().enumerate() {
                if self.ports.answers[row] == Answer::Current {
                    reply.admittance[row * ports + p][0] += electrics.conductance[(other, port)];
                }
            }
        }
        Ok(())
    }
}
