//! From a mechanism at an operating point to the reduced linear model.
//!
//! With the tangent K, the masses M and the damping C at the operating point, and forces b_q per unit of each input,
//! ```text
//! M·q̈ + C·q̇ + K·q = Σ b_q·u_q,     q ≈ Σ_j φ_j·η_j + Σ_q z_q·u_q,     z_q = K⁻¹·b_q − Σ_j φ_j·(φ_jᵀ·b_q)/λ_j
//! ```
//! φ_j are undamped modes with φᵀMφ = 1. z_q, the static correction, is what the modes that are left out yield at rest; directions of
//! it may swing, too ([`super::basis`]). What heats at once pushes by b_q; a heater with a time constant pushes behind its lag, and all
//! heaters with the same time constant that one port heats share one lag: their rises are in proportion to it.

use super::basis::Basis;
use super::linear::{Lag, Mode, Port, Reduced, SignalShown};
use super::{ExportError, Request};
use crate::analysis::AnalysisError;
use crate::analysis::signal::{Signal, View};
use crate::analysis::statics::operating_point;
use crate::compile::Compiled;
use crate::device::PortKind;
use crate::device::ports::{Answer, Ports};
use crate::device::scale::Scale;
use crate::gaps::{Drive, System};
use crate::multibody::BlockMatrix;
use crate::multibody::forces::add_damping;
use crate::multibody::planar::Pose;
use crate::solve::SolveError;
use crate::solve::frequency::refined::{ROUNDING, Refined};
use nalgebra::{DMatrix, DVector};

/// Displacement that a volt of a mode's share stands for where the mode moves most [m].
const MICROMETRE: f64 = 1e-6;
/// A coupling below this share of the largest of its kind is rounding.
const NONE: f64 = 1e-10;

/// What is read in a row of y.
#[derive(Debug, Clone, Copy)]
enum Row {
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

/// A unit of one input, at once or behind a lag: what it does to a mechanism that does not swing.
#[derive(Debug)]
pub(super) struct Push {
    port: usize,
    /// Time constant that it comes with [s]; none: at once.
    tau: Option<f64>,
    pub(super) force: Vec<Pose>,
    /// K⁻¹ times the force.
    pub(super) yielded: Vec<Pose>,
    volts: Vec<f64>,
    rise: Vec<f64>,
}

/// A mechanism at its operating point, with the inputs and outputs that a model is made for.
#[derive(Debug)]
pub struct Mechanism<'a> {
    compiled: &'a Compiled,
    ports: Ports,
    names: Vec<String>,
    across: Vec<Option<f64>>,
    shown: Vec<(Signal, SignalShown)>,
    pub(super) q: Vec<Pose>,
    sources: Vec<f64>,
    rise: Vec<f64>,
    pub(super) drive: Drive,
    pub(super) tangent: BlockMatrix<f64, 3>,
    pub(super) factor: BlockMatrix<f64, 3>,
    pub(super) pushes: Vec<Push>,
}

/// The ports of a request by name: those asked for, or every electrical one.
///
/// # Errors
/// [`ExportError::NoPorts`].
pub fn port_names(compiled: &Compiled, request: &Request) -> Result<Vec<(String, Option<f64>)>, ExportError> {
    let electrics = &compiled.parts.system.electrics;
    let names = match request.ports.as_slice() {
        [] => electrics.names[..electrics.ports].iter().map(|n| (n.clone(), None)).collect(),
        ports => ports.to_vec(),
    };
    if names.is_empty() { Err(ExportError::NoPorts) } else { Ok(names) }
}

impl<'a> Mechanism<'a> {
    /// Finds the operating point and what each input does there.
    ///
    /// # Errors
    /// See [`ExportError`].
    pub fn new(compiled: &'a Compiled, request: &Request) -> Result<Self, ExportError> {
        let (names, across): (Vec<_>, Vec<_>) = port_names(compiled, request)?.into_iter().unzip();
        let ports = Ports::find(compiled, &names)?;
        if let Some(k) = ports.kinds.iter().position(|kind| *kind == PortKind::Rate) {
            return Err(ExportError::Turning { port: names[k].clone() });
        }
        let shown = (request.signals.iter())
            .map(|(name, scale)| {
                let signal = Signal::find(compiled, name)?;
                Ok((signal, SignalShown { name: name.clone(), unit: signal.unit(), scale: *scale }))
            })
            .collect::<Result<Vec<_>, AnalysisError>>()?;
        let point = operating_point(compiled, &request.bias)?;
        let own = ports.system.clone();
        let system = own.as_deref().unwrap_or(&compiled.parts.system);
        let mut sources = point.sources;
        sources.resize(system.electrics.sources(), 0.0);
        let mut drive = system.electrics.drive();
        system.electrics.apply(&sources, &point.rise, &mut drive);
        let mut tangent = BlockMatrix::new(&system.model.pattern);
        let mut residual = point.q.clone();
        system.tangent(&point.q, &drive, &mut tangent, &mut residual);
        let mut factor = tangent.clone();
        system.model.project_matrix(&mut factor);
        let inertia = factor.factor(&system.model.pattern);
        let inertia = inertia.map_err(|p| AnalysisError::from(SolveError::singular(system, p)))?;
        if inertia.negative > 0 {
            return Err(ExportError::Unstable { negative: inertia.negative });
        }
        let mut mechanism = Self {
            compiled,
            ports,
            names,
            across,
            shown,
            q: point.q,
            sources,
            rise: point.rise,
            drive,
            tangent,
            factor,
            pushes: Vec::new(),
        };
        mechanism.pushes = mechanism.pushes();
        Ok(mechanism)
    }

    pub(super) fn system(&self) -> &System {
        self.ports.system.as_deref().unwrap_or(&self.compiled.parts.system)
    }

    /// Every push of every port.
    fn pushes(&self) -> Vec<Push> {
        let system = self.system();
        let electrics = &system.electrics;
        let heaters = &electrics.heating.heaters;
        let mut refined = Refined::new(system, &self.q, &self.drive);
        let mut pushes = Vec::new();
        for (port, &source) in self.ports.sources.iter().enumerate() {
            crate::budget::check();
            let mut unit = vec![0.0; electrics.sources()];
            unit[source] = 1.0;
            let slopes: Vec<f64> =
                (0..heaters.len()).map(|k| electrics.heating.slope(k, &self.sources, &unit)).collect();
            let mut taus: Vec<Option<f64>> = vec![None];
            for (heater, slope) in heaters.iter().zip(&slopes) {
                let tau = Some(heater.time_constant).filter(|tau| *tau > 0.0);
                if *slope != 0.0 && !taus.contains(&tau) {
                    taus.push(tau);
                }
            }
            for tau in taus {
                let of = |(h, slope): (&crate::gaps::thermal::Heater, &f64)| {
                    let own = Some(h.time_constant).filter(|tau| *tau > 0.0);
                    if own == tau { *slope } else { 0.0 }
                };
                let rise: Vec<f64> = heaters.iter().zip(&slopes).map(of).collect();
                let mut change = electrics.drive();
                change.load = 0.0;
                for ((strain, heater), rise) in change.expansion.iter_mut().zip(heaters).zip(&rise) {
                    *strain = heater.expansion * rise;
                }
                if tau.is_none() {
                    for (g, volts) in change.volts.iter_mut().enumerate() {
                        *volts = electrics.gap_rows[(g, source)];
                    }
                    change.inputs.copy_from_slice(&unit[electrics.voltages()..]);
                }
                let mut force = vec![Pose::zeros(); system.bodies()];
                system.drive_force(&self.q, &self.drive, &change, &mut force);
                force.iter_mut().for_each(|f| *f = -*f);
                let mut yielded = force.clone();
                self.yielded(&mut refined, &mut yielded);
                pushes.push(Push { port, tau, force, yielded, volts: change.volts, rise });
            }
        }
        pushes
    }

    /// K⁻¹ times a force, in place.
    pub(super) fn yielded(&self, refined: &mut Refined<'_>, force: &mut [Pose]) {
        let model = &self.system().model;
        if model.linear {
            model.project(force);
            self.factor.solve(&model.pattern, force);
            model.project(force);
        } else {
            refined.solve(&self.factor, 0.0, force, ROUNDING);
        }
    }

    /// The model with these directions. Values at rest are left at 0.
    pub fn reduced(&self, basis: &Basis) -> Reduced {
        let system = self.system();
        let scales: Vec<Scale> =
            self.ports.kinds.iter().zip(&self.across).map(|(kind, across)| Scale::new(*kind, *across)).collect();
        let rows = self.rows();
        let (n, r, p) = (basis.lambda.len(), rows.len(), scales.len());
        let answered = |row: usize| if row < p { scales[row].answered } else { self.shown[row - p].1.scale };
        let (shapes, lambda) = (&basis.shapes, &basis.lambda);
        let omega: Vec<f64> = lambda.iter().map(|l| l.sqrt()).collect();
        let length: Vec<f64> = shapes.iter().map(|x| MICROMETRE / self.largest(x)).collect();
        let lags: Vec<&Push> = self.pushes.iter().filter(|push| push.tau.is_some()).collect();
        let mut model = Reduced {
            ports: (0..p).map(|k| self.port(k)).collect(),
            signals: self.shown.iter().map(|(_, shown)| shown.clone()).collect(),
            modes: basis.numbers.iter().zip(&omega).map(|(&number, &omega)| Mode { number, omega }).collect(),
            lags: lags.iter().map(|l| Lag { port: l.port, tau: l.tau.unwrap_or(0.0) }).collect(),
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
        let still = (vec![0.0; self.drive.volts.len()], vec![0.0; self.rise.len()]);
        for k in 0..n {
            drag.fill(Pose::zeros());
            add_damping(&system.model, &shapes[k], &mut drag);
            for j in 0..n {
                model.damping[(j, k)] = dot(&shapes[j], &drag) * (length[k] * omega[k]) / (length[j] * omega[j]);
            }
            for (row, read) in rows.iter().enumerate() {
                let value = answered(row) * length[k] * self.read(*read, &shapes[k], &still.0, &still.1);
                match read {
                    Row::Change(_) | Row::Current(_) => model.rate[(row, k)] = value * omega[k],
                    _ => model.place[(row, k)] = value,
                }
            }
        }
        let mut l = 0;
        for push in &self.pushes {
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
                    (Row::Change(_) | Row::Current(_), None) => model.change[(row, q)] += value,
                    // of what lags the rate is (u − h)/τ
                    (Row::Change(_) | Row::Current(_), Some(tau)) => {
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
            if let Row::Current(source) = read {
                for (q, &other) in self.ports.sources.iter().enumerate() {
                    model.direct[(row, q)] += system.electrics.conductance[(*source, other)];
                }
            }
        }
        without_rounding(&mut model);
        model
    }

    fn port(&self, k: usize) -> Port {
        let kind = self.ports.kinds[k];
        let scale = Scale::new(kind, self.across[k]);
        let across = if kind.given_flow() { scale.answered } else { 1.0 / scale.given };
        let bias = (kind == PortKind::Electrical).then(|| self.sources[self.ports.sources[k]]);
        Port { name: self.names[k].clone(), kind, across, bias }
    }

    /// What is read in each row: ports, then signals.
    fn rows(&self) -> Vec<Row> {
        let of_signal = |signal: Signal| match signal {
            Signal::Rate(point, direction) => Row::Change(Signal::Displacement(point, direction)),
            level => Row::Level(level),
        };
        let of_port = |(answer, source): (&Answer, &usize)| match answer {
            Answer::Current => Row::Current(*source),
            Answer::Motion(signal) => of_signal(*signal),
            Answer::Rise(heater) => Row::Rise(*heater),
            Answer::Nothing => Row::Nothing,
        };
        let ports = self.ports.answers.iter().zip(&self.ports.sources).map(of_port);
        ports.chain(self.shown.iter().map(|(signal, _)| of_signal(*signal))).collect()
    }

    /// Change of a row's quantity (of its charge, of what it is the rate of) with a change of state.
    fn read(&self, row: Row, q: &[Pose], volts: &[f64], rise: &[f64]) -> f64 {
        let system = self.system();
        let still = vec![Pose::zeros(); self.q.len()];
        match row {
            Row::Level(signal) | Row::Change(signal) => {
                let state = View { q: &self.q, v: &still, rise: &self.rise, volts: &self.drive.volts };
                signal.slope(self.compiled, &state, &View { q, v: &still, rise, volts })
            }
            Row::Current(source) => (0..volts.len())
                .map(|g| {
                    let charge = system.capacitance(g, &self.q) * volts[g]
                        + system.capacitance_slope(g, &self.q, q) * self.drive.volts[g];
                    system.electrics.gap_rows[(g, source)] * charge
                })
                .sum(),
            Row::Rise(heater) => rise[heater],
            Row::Nothing => 0.0,
        }
    }

    /// Largest displacement in a shape [m]; where nothing but rotation is, that of a lever of a millimetre.
    fn largest(&self, shape: &[Pose]) -> f64 {
        let nodes = self.compiled.parts.nodes.iter().flatten().map(|p| p.displacement(shape, true).norm());
        let moved = nodes.chain(shape.iter().map(|x| x.xy().norm())).fold(0.0, f64::max);
        let turned = shape.iter().map(|x| 1e-3 * x.z.abs()).fold(0.0, f64::max);
        if moved > NONE * turned { moved } else { turned.max(f64::MIN_POSITIVE) }
    }
}

pub(super) fn dot(a: &[Pose], b: &[Pose]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

/// Takes away couplings that are none but for rounding.
fn without_rounding(model: &mut Reduced) {
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
