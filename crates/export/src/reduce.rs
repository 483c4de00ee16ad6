//! From a mechanism at an operating point to the reduced linear model.
//!
//! With the tangent K, the masses M and the damping C at the operating point, and forces b_q per unit of each input,
//! ```text
//! M·q̈ + C·q̇ + K·q = Σ b_q·u_q,     q ≈ Σ_j φ_j·η_j + Σ_q z_q·u_q,     z_q = K⁻¹·b_q − Σ_j φ_j·(φ_jᵀ·b_q)/λ_j
//! ```
//! φ_j are undamped modes with φᵀMφ = 1. z_q, the static correction, is what the modes that are left out yield at rest;
//! directions of it may swing, too ([`super::basis`]). Instantaneous heating excites by b_q. A heater with a time
//! constant excites behind its lag. All heaters with the same time constant on one port share one lag, since their
//! temperature rises are proportional to it.

use super::basis::Basis;
use super::linear::{HeatLag, ReducedMode, ReducedModel, ReducedPort};
use super::mechanism::{DENSE_WORK, InputExcitation, dot};
pub use super::mechanism::{LinearizedMechanism, port_names};
use bimorph_analysis::readout::ports::PortResponse;
use bimorph_analysis::readout::signal::{Signal, SignalView};
use bimorph_device::PortKind;
use bimorph_device::scale::PortScale;
use bimorph_domains::loss_derivatives::LossDerivatives;
use bimorph_multibody::forces::add_damping;
use bimorph_multibody::planar::Pose;
use nalgebra::{DMatrix, DVector};

/// Displacement that a volt of a mode's share stands for where the mode moves most (m).
pub(super) const MICROMETRE: f64 = 1e-6;
/// A coupling below this fraction of the largest of its kind is rounding.
const NONE: f64 = 1e-10;

/// Kind of a row of y.
#[derive(Debug, Clone, Copy)]
pub(super) enum OutputRow {
    /// A quantity of the state.
    Level(Signal),
    /// Its rate of change.
    Change(Signal),
    /// Current into a source.
    Current(usize),
    /// Rise of a heater.
    Rise(usize),
    /// Nothing.
    Nothing,
}

impl LinearizedMechanism<'_> {
    /// The model with these directions. Values at rest are left at 0.
    pub fn reduced(&self, basis: &Basis) -> ReducedModel {
        let system = self.system();
        let scales: Vec<PortScale> =
            self.ports.kinds.iter().zip(&self.across).map(|(kind, across)| PortScale::new(*kind, *across)).collect();
        let rows = self.rows();
        let (n, r, p) = (basis.lambda.len(), rows.len(), scales.len());
        bimorph_base::budget::modes(n, || DENSE_WORK * n);
        bimorph_base::budget::lay_out_matrix(r, 2 * (n + p));
        let answered = |row: usize| if row < p { scales[row].answered } else { self.shown[row - p].1.scale };
        let (shapes, lambda) = (&basis.shapes, &basis.lambda);
        let omega: Vec<f64> = lambda.iter().map(|l| l.sqrt()).collect();
        let length: Vec<f64> = shapes.iter().map(|x| MICROMETRE / self.largest(x)).collect();
        let lags: Vec<&InputExcitation> = self.pushes.iter().filter(|push| push.tau.is_some()).collect();
        let mut model = ReducedModel {
            ports: (0..p).map(|k| self.port(k)).collect(),
            signals: self.shown.iter().map(|(_, shown)| shown.clone()).collect(),
            modes: basis.numbers.iter().zip(&omega).map(|(&number, &omega)| ReducedMode { number, omega }).collect(),
            lags: lags.iter().map(|l| HeatLag { port: l.port, tau: l.tau.unwrap_or(0.0) }).collect(),
            damping: DMatrix::zeros(n, n),
            push: DMatrix::zeros(n, p),
            push_lagged: DMatrix::zeros(n, lags.len()),
            at_rest: DVector::zeros(r),
            place: DMatrix::zeros(r, n),
            rate: DMatrix::zeros(r, n),
            lagged: DMatrix::zeros(r, lags.len()),
            direct: DMatrix::zeros(r, p),
            change: DMatrix::zeros(r, p),
        };
        let mut drag = vec![Pose::zeros(); system.bodies()];
        let mut loss = LossDerivatives::of(system);
        if let Some(loss) = &mut loss {
            loss.at(system, &self.q, |_| Pose::zeros());
        }
        let still = (vec![0.0; self.drive.volts.len()], vec![0.0; self.rise.len()]);
        for k in 0..n {
            bimorph_base::budget::check();
            drag.fill(Pose::zeros());
            add_damping(&system.model, &shapes[k], &mut drag);
            if let Some(loss) = &loss {
                loss.add_damping(|j| shapes[k][j], &mut drag);
            }
            for j in 0..n {
                model.damping[(j, k)] = dot(&shapes[j], &drag) * (length[k] * omega[k]) / (length[j] * omega[j]);
            }
            for (row, read) in rows.iter().enumerate() {
                let value = answered(row) * length[k] * self.read(*read, &shapes[k], &still.0, &still.1);
                match read {
                    OutputRow::Change(_) | OutputRow::Current(_) => model.rate[(row, k)] = value * omega[k],
                    _ => model.place[(row, k)] = value,
                }
            }
        }
        let mut l = 0;
        for push in &self.pushes {
            bimorph_base::budget::check();
            let (q, given) = (push.port, scales[push.port].given);
            let shares: Vec<f64> = shapes.iter().map(|x| dot(x, &push.force)).collect();
            for j in 0..n {
                let share = given * shares[j] / (length[j] * lambda[j]);
                match push.tau {
                    None => model.push[(j, q)] = share,
                    Some(_) => model.push_lagged[(j, l)] = share,
                }
            }
            let rest = self.left(push, basis);
            for (row, read) in rows.iter().enumerate() {
                let value = answered(row) * given * self.read(*read, &rest, &push.volts, &push.rise);
                let whole = answered(row) * given * self.read(*read, &push.yielded, &push.volts, &push.rise);
                if value.abs() < NONE * whole.abs() {
                    continue; // all of it is in the directions
                }
                match (read, push.tau) {
                    (OutputRow::Change(_) | OutputRow::Current(_), None) => model.change[(row, q)] += value,
                    // of what lags the rate is (u − h)/τ
                    (OutputRow::Change(_) | OutputRow::Current(_), Some(tau)) => {
                        model.direct[(row, q)] += value / tau;
                        model.lagged[(row, l)] -= value / tau;
                    }
                    (_, None) => model.direct[(row, q)] += value,
                    (_, Some(_)) => model.lagged[(row, l)] += value,
                }
            }
            l += usize::from(push.tau.is_some());
        }
        for (row, read) in rows.iter().enumerate() {
            if let OutputRow::Current(source) = read {
                for (q, &other) in self.ports.sources.iter().enumerate() {
                    model.direct[(row, q)] += system.electrics.conductance[(*source, other)];
                }
            }
        }
        without_rounding(&mut model);
        model
    }

    fn port(&self, k: usize) -> ReducedPort {
        let kind = self.ports.kinds[k];
        let scale = PortScale::new(kind, self.across[k]);
        let across = if kind.given_flow() { scale.answered } else { 1.0 / scale.given };
        let bias = (kind == PortKind::Electrical).then(|| self.sources[self.ports.sources[k]]);
        ReducedPort { name: self.names[k].clone(), kind, across, bias }
    }

    /// The rows of y: ports, then signals.
    pub(super) fn rows(&self) -> Vec<OutputRow> {
        let of_signal = |signal: Signal| match signal {
            Signal::Rate(point, direction) => OutputRow::Change(Signal::Displacement(point, direction)),
            level => OutputRow::Level(level),
        };
        let of_port = |(answer, source): (&PortResponse, &usize)| match answer {
            PortResponse::Current => OutputRow::Current(*source),
            PortResponse::Motion(signal) => of_signal(*signal),
            PortResponse::Rise(heater) => OutputRow::Rise(*heater),
            PortResponse::Nothing => OutputRow::Nothing,
        };
        let ports = self.ports.answers.iter().zip(&self.ports.sources).map(of_port);
        ports.chain(self.shown.iter().map(|(signal, _)| of_signal(*signal))).collect()
    }

    /// Change of a row's quantity (of its charge, of what it is the rate of) with a change of state.
    pub(super) fn read(&self, row: OutputRow, q: &[Pose], volts: &[f64], rise: &[f64]) -> f64 {
        let system = self.system();
        let still = vec![Pose::zeros(); self.q.len()];
        match row {
            OutputRow::Level(signal) | OutputRow::Change(signal) => {
                let state = SignalView { q: &self.q, v: &still, rise: &self.rise, volts: &self.drive.volts };
                signal.slope(self.compiled, &state, &SignalView { q, v: &still, rise, volts })
            }
            OutputRow::Current(source) => (0..volts.len())
                .map(|g| {
                    let charge = system.charge_slope(g, (&self.q, &self.drive.volts), (q, Some(volts)));
                    system.electrics.gap_rows[(g, source)] * charge
                })
                .sum(),
            OutputRow::Rise(heater) => rise[heater],
            OutputRow::Nothing => 0.0,
        }
    }

    /// Largest displacement in a shape (m); where nothing but rotation is, that of a lever of a millimetre.
    pub(super) fn largest(&self, shape: &[Pose]) -> f64 {
        let nodes = self.compiled.parts.nodes.iter().flatten().map(|p| p.displacement(shape, true).norm());
        let moved = nodes.chain(shape.iter().map(|x| x.xy().norm())).fold(0.0, f64::max);
        let turned = shape.iter().map(|x| 1e-3 * x.z.abs()).fold(0.0, f64::max);
        if moved > NONE * turned { moved } else { turned.max(f64::MIN_POSITIVE) }
    }
}

/// Removes couplings that consist of rounding alone.
fn without_rounding(model: &mut ReducedModel) {
    let diagonal = model.damping.diagonal();
    for j in 0..diagonal.len() {
        for k in 0..diagonal.len() {
            if j != k && model.damping[(j, k)].abs() < NONE * diagonal[j].abs().max(diagonal[k].abs()) {
                model.damping[(j, k)] = 0.0;
            }
        }
    }
    let by_column = |m: &mut DMatrix<f64>| {
        for mut column in m.column_iter_mut() {
            let most = column.amax();
            column.iter_mut().filter(|x| x.abs() < NONE * most).for_each(|x| *x = 0.0);
        }
    };
    by_column(&mut model.push);
    by_column(&mut model.push_lagged);
    for m in [&mut model.place, &mut model.rate] {
        for mut row in m.row_iter_mut() {
            let most = row.amax();
            row.iter_mut().filter(|x| x.abs() < NONE * most).for_each(|x| *x = 0.0);
        }
    }
}
