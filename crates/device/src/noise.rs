//! Noise of ports and signals: the thermal noise of drag, dampers and resistors in every output.
//!
//! Drag and dampers push the mechanism with forces of the spectral density 4·k_B·T·C ([`bimorph_multibody::agitation`]), and a
//! beam that carries current has Johnson's 4·k_B·T/R across it, T with its own rise. With hᵢ what a unit force on each body
//! does to answer i, the one-sided spectral densities of the answers and their cross-spectra are
//! ```text
//! S_ij = 4·k_B·T·hᵢᵀ·C·h̄_j + 4·k_B·[T·G_ij + Σ_k rise_k·R_k·I_ki·I_kj]     [answered²/Hz]
//! ```
//! G is the conductance between electrical ports, and I_ki the current in beam k for a volt at port i. The vector hᵢ follows from
//! one solution for each output, not for each damper: hᵢ = Z⁻ᵀ·lᵢ, where lᵢ is the gradient of output i over
//! displacements (the adjoint of the response). In a rotating frame Z differs from its transpose by the sign of the
//! rate.
//!
//! An answer is that with nothing else changed: the current of a port whose voltage is held, the motion of one whose force
//! is. Left out: fluctuations of temperature, and what Johnson's noise heats. Resistances that depend on temperature are those of the state.

use super::output_gradient::{OutputGradient, surroundings};
use super::session::DeviceSession;
use super::states::Snapshot;
use super::{DeviceError, Token};
use bimorph_analysis::readout::ports::PortResponse;
use bimorph_analysis::readout::signal::{Signal, SignalView};
use bimorph_base::budget;
use bimorph_domains::System;
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::agitation::{BOLTZMANN, damped};
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_solve::frequency::gyroscopic;
use bimorph_solve::harmonic::ComplexPose;
use nalgebra::Complex;

impl DeviceSession {
    /// Spectral densities of ports, then signals, about a state: row-major, complex.
    pub(super) fn noise(
        &mut self,
        compiled: &CompiledModel,
        (token, state): (Token, &Snapshot),
        omega: f64,
        out: &mut Vec<[f64; 2]>,
    ) -> Result<(), DeviceError> {
        let own = self.ports.system.clone();
        let system = Self::system(&own, compiled);
        self.factor_about(system, token, state, omega)?;
        let rate = system.frame(&self.drive).map_or(0.0, |frame| frame.rate);
        let (ports, n) = (self.ports.len(), system.bodies());
        let answers = ports + self.signals.len();
        budget::lay_out_matrix(answers, 12 * n + 2 * answers);

        if self.seen.as_ref().is_none_or(|(t, _)| *t != token) {
            let seen = (0..answers).map(|i| {
                budget::check();
                self.seen_by(compiled, system, state, i)
            });
            self.seen = Some((token, seen.collect()));
        }
        let Some((_, seen)) = &self.seen else { return Err(DeviceError::NotOpen) };
        let mut adjoint: Vec<Vec<ComplexPose>> = Vec::with_capacity(answers);
        for seen in seen {
            budget::check();
            let mut h = seen.at(omega);
            for (h, body) in h.iter_mut().zip(&system.model.bodies) {
                if let Some(free) = &body.free {
                    *h = free.map(Complex::from) * *h;
                }
            }
            gyroscopic::solve(&mut self.harmonic, system, (omega, -rate), &mut h);
            adjoint.push(h);
        }
        let warm = 4.0 * BOLTZMANN * surroundings(compiled);
        out.clear();
        out.resize(answers * answers, [0.0; 2]);
        for j in 0..answers {
            budget::check();
            let pushed = damped(&system.model, &adjoint[j], |x, y| self.harmonic.add_loss(x, y));
            for i in 0..=j {
                let sum: Complex<f64> =
                    adjoint[i].iter().zip(&pushed).map(|(h, p)| h.x * p.x + h.y * p.y + h.z * p.z).sum();
                let johnson = self.johnson(system, state, (i, j)) * 4.0 * BOLTZMANN;
                let sum = sum * warm + johnson + self.conducted(system, state, (i, j)) * warm;
                // one half gives the other: the matrix is Hermitian to the last bit
                out[i * answers + j] = [sum.re, if i == j { 0.0 } else { sum.im }];
                out[j * answers + i] = [sum.re, if i == j { 0.0 } else { -sum.im }];
            }
        }
        Ok(())
    }

    /// Gradient of output `i`.
    fn seen_by(&self, compiled: &CompiledModel, system: &System, state: &Snapshot, i: usize) -> OutputGradient {
        let mut seen = OutputGradient::nothing(system.bodies());
        let signal = match i.checked_sub(self.ports.len()) {
            Some(signal) => self.signals[signal].clone(),
            None => match self.ports.answers[i] {
                PortResponse::Current => {
                    seen.change = self.charge_seen(system, state, self.ports.sources[i]);
                    return seen;
                }
                PortResponse::Motion(signal) => signal.into(),
                PortResponse::Rise(_) | PortResponse::Nothing => return seen,
            },
        };
        if signal.quantities().all(|one| matches!(one, Signal::Temperature(_) | Signal::Prescribed(_))) {
            return seen;
        }
        let (heaters, gaps) = (state.rise.len(), self.drive.volts.len());
        let view = SignalView { q: &state.q, v: &state.v, rise: &state.rise, volts: &self.drive.volts };
        let (cold, off) = (vec![0.0; heaters], vec![0.0; gaps]);
        let mut unit = vec![Pose::zeros(); system.bodies()];
        let still = unit.clone();
        for k in 0..unit.len() {
            for d in 0..DOF {
                unit[k][d] = 1.0;
                let place = SignalView { q: &unit, v: &still, rise: &cold, volts: &off };
                let motion = SignalView { q: &still, v: &unit, rise: &cold, volts: &off };
                seen.place[k][d] = signal.slope(compiled, &view, &place);
                seen.change[k][d] = signal.slope(compiled, &view, &motion);
                unit[k][d] = 0.0;
            }
        }
        seen
    }

    /// Gradient of the charge of source `source` over displacements: minus the force of a volt there.
    fn charge_seen(&self, system: &System, state: &Snapshot, source: usize) -> Vec<Pose> {
        let mut change = system.electrics.drive();
        change.load = 0.0;
        for (g, volts) in change.volts.iter_mut().enumerate() {
            *volts = system.electrics.gap_rows[(g, source)];
        }
        let mut force = vec![Pose::zeros(); system.bodies()];
        system.drive_force(&state.q, &self.drive, &change, &mut force);
        force.iter_mut().for_each(|f| *f = -*f);
        force
    }

    /// Σ rise·R·I·I of two answers (K·S).
    fn johnson(&self, system: &System, state: &Snapshot, (i, j): (usize, usize)) -> f64 {
        let Some((a, b)) = self.both_electrical(i, j) else { return 0.0 };
        system.electrics.heated_noise(&state.rise, a, b)
    }

    /// Conductance between two answers (S).
    fn conducted(&self, system: &System, state: &Snapshot, (i, j): (usize, usize)) -> f64 {
        self.both_electrical(i, j).map_or(0.0, |(a, b)| system.electrics.conductance_between(&state.rise, a, b))
    }

    /// The sources of two answers, if both are currents.
    fn both_electrical(&self, i: usize, j: usize) -> Option<(usize, usize)> {
        let source = |i: usize| {
            let current = self.ports.answers.get(i) == Some(&PortResponse::Current);
            current.then(|| self.ports.sources[i])
        };
        Some((source(i)?, source(j)?))
    }
}
