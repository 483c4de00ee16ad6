//! A mechanism at an operating point, and what a unit of each input does to it there.

use super::linear::SignalShown;
use super::{ExportError, ExportRequest};
use bimorph_analysis::AnalysisError;
use bimorph_analysis::readout::expression::Quantity;
use bimorph_analysis::readout::ports::OpenedPorts;
use bimorph_analysis::readout::signal::Signal;
use bimorph_analysis::statics::operating_point;
use bimorph_device::PortKind;
use bimorph_domains::thermal::HeatConductor;
use bimorph_domains::{Drive, System};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;
use bimorph_solve::SolveError;
use bimorph_solve::frequency::refined::{ROUNDING, Refined};

/// Unknowns that a dense matrix counts as for each of its rows in the work of modes: its factorization has no check of the budget.
pub(super) const DENSE_WORK: usize = 10;

/// A unit of one input, at once or behind a lag: what it does to a mechanism that does not swing.
#[derive(Debug)]
pub(super) struct InputExcitation {
    pub(super) port: usize,
    /// Time constant that it comes with (s); none: at once.
    pub(super) tau: Option<f64>,
    pub(super) force: Vec<Pose>,
    /// K⁻¹ times the force.
    pub(super) yielded: Vec<Pose>,
    pub(super) volts: Vec<f64>,
    pub(super) rise: Vec<f64>,
}

/// A mechanism at its operating point, with the inputs and outputs that a model is made for.
#[derive(Debug)]
pub struct LinearizedMechanism<'a> {
    pub(super) compiled: &'a CompiledModel,
    pub(super) ports: OpenedPorts,
    pub(super) names: Vec<String>,
    pub(super) across: Vec<Option<f64>>,
    pub(super) shown: Vec<(Signal, SignalShown)>,
    pub(super) q: Vec<Pose>,
    pub(super) sources: Vec<f64>,
    pub(super) rise: Vec<f64>,
    pub(super) drive: Drive,
    pub(super) tangent: BodyMatrix,
    pub(super) factor: BodyMatrix,
    pub(super) pushes: Vec<InputExcitation>,
}

/// The ports of a request by name: the requested ones, or every electrical one.
///
/// # Errors
/// [`ExportError::NoPorts`].
pub fn port_names(
    compiled: &CompiledModel,
    request: &ExportRequest,
) -> Result<Vec<(String, Option<f64>)>, ExportError> {
    let electrics = &compiled.parts.system.electrics;
    let names = match request.ports.as_slice() {
        [] => electrics.names[..electrics.ports].iter().map(|n| (n.clone(), None)).collect(),
        ports => ports.to_vec(),
    };
    if names.is_empty() { Err(ExportError::NoPorts) } else { Ok(names) }
}

/// Refuses models with driven anchors.
///
/// # Errors
/// [`ExportError::DrivenAnchor`].
pub(super) fn refuse_driven(compiled: &CompiledModel) -> Result<(), ExportError> {
    let driven = compiled.structure.supports.iter().find(|s| s.motion.is_some_and(|m| m.driven || m.rotation != 0.0));
    match driven {
        Some(support) => Err(ExportError::DrivenAnchor { node: compiled.structure.nodes[support.node.0].name.clone() }),
        None => Ok(()),
    }
}

pub(super) fn dot(a: &[Pose], b: &[Pose]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

impl<'a> LinearizedMechanism<'a> {
    /// Finds the operating point and what each input does there.
    ///
    /// # Errors
    /// See [`ExportError`].
    pub fn new(compiled: &'a CompiledModel, request: &ExportRequest) -> Result<Self, ExportError> {
        let (names, across): (Vec<_>, Vec<_>) = port_names(compiled, request)?.into_iter().unzip();
        let ports = OpenedPorts::find(compiled, &names)?;
        if let Some(k) = ports.kinds.iter().position(|kind| *kind == PortKind::Rate) {
            return Err(ExportError::Turning { port: names[k].clone() });
        }
        refuse_driven(compiled)?;
        let heating = &compiled.parts.system.electrics.heating;
        let dependent = heating.heaters.iter().position(HeatConductor::depends_on_temperature);
        // anchors alone may have temperatures of their own
        if let Some(k) = dependent.or(heating.is_hot().then_some(0)) {
            let beam = compiled.structure.beams[compiled.parts.heaters[k]].name.clone();
            return Err(ExportError::HotResistance { beam });
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
        let mut tangent = BodyMatrix::new(&system.model.pattern);
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
    fn pushes(&self) -> Vec<InputExcitation> {
        let system = self.system();
        let electrics = &system.electrics;
        let heaters = &electrics.heating.heaters;
        let mut refined = Refined::new(system, &self.q, &self.drive);
        let mut pushes = Vec::new();
        for (port, &source) in self.ports.sources.iter().enumerate() {
            bimorph_base::budget::check();
            let mut unit = vec![0.0; electrics.sources()];
            unit[source] = 1.0;
            let mut slopes = vec![0.0; heaters.len()];
            electrics.heating.slopes(&self.sources, &self.rise, &unit, &mut slopes);
            let mut taus: Vec<Option<f64>> = vec![None];
            for (heater, slope) in heaters.iter().zip(&slopes) {
                let tau = Some(heater.time_constant).filter(|tau| *tau > 0.0);
                if *slope != 0.0 && !taus.contains(&tau) {
                    taus.push(tau);
                }
            }
            for tau in taus {
                // its force, its response, and the directions that are made of them
                bimorph_base::budget::lay_out(8 * size_of::<Pose>() * system.bodies());
                let of = |(h, slope): (&bimorph_domains::thermal::HeatConductor, &f64)| {
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
                pushes.push(InputExcitation { port, tau, force, yielded, volts: change.volts, rise });
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
}
