//! Session of a device: its ports, its signals, its states, and the storage that every trial reuses.

pub(crate) mod reduction;

use super::agitation::ThermalForce;
use super::growth::{Difference, Growth};
use super::held_motion::HeldMotion;
use super::macro_step::{DisplayOffset, MacroStepPosition};
use super::multirate::{MacroStepper, Multirate};
use super::output_gradient::{OutputGradient, surroundings};
use super::phase_error::PhaseErrorMonitor;
use super::states::{Snapshot, States};
use super::{Description, DeviceError, Mode, OpenRequest, PortInfo, PortKind, SignalInfo, Token, Trial};
use bimorph_analysis::readout::expression::Expression;
use bimorph_analysis::readout::ports::{OpenedPorts, PortResponse};
use bimorph_analysis::readout::signal::Signal;
use bimorph_analysis::reduced::circuit::CircuitReduction;
use bimorph_analysis::transient::first_step;
use bimorph_base::budget;
use bimorph_domains::drive::Electrics;
use bimorph_domains::{Drive, System};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;
use bimorph_solve::equations::bodies::NormWeights;
use bimorph_solve::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph_solve::harmonic::{ComplexPose, Harmonic};
use bimorph_solve::time::adaptive::Adaptive;
use bimorph_solve::time::formulated::Formulated;
use bimorph_solve::time::method::Motion;
use reduction::SessionReduction;
use std::sync::Arc;

/// An open session: the choice of ports and signals, the states, and the storage that every trial reuses.
#[derive(Debug)]
pub(super) struct DeviceSession {
    /// The request that opened it.
    pub(super) opened: OpenRequest,
    pub(super) ports: OpenedPorts,
    pub(super) signals: Vec<Expression<Signal>>,
    pub(super) states: States,
    pub(super) first_step: f64,
    pub(super) equilibrium: Equilibrium,
    /// Thermal agitation, if requested.
    pub(super) shaken: Option<ThermalForce>,
    /// The reduced model, if trials have one.
    pub(super) reduction: Option<SessionReduction>,
    /// Why trials have the full model, though a reduced one was requested.
    pub(super) full_because: Option<String>,
    /// The trial at hand is taken again in the full model.
    pub(super) takes_bodies: bool,
    /// Carries ∂motion/∂(final voltage), one for each opened port.
    pub(super) stepper: Adaptive<Formulated>,
    /// Weights of its step errors.
    pub(super) weights: NormWeights,
    pub(super) motion: Motion,
    pub(super) rise: Vec<f64>,
    pub(super) rise_slope: Vec<f64>,
    pub(super) sources: Vec<f64>,
    pub(super) unit: Vec<f64>,
    pub(super) drive: Drive,
    /// Capacitance of each gap at the motion at hand (F).
    pub(super) capacitances: Vec<f64>,
    pub(super) change: Drive,
    pub(super) linear: Option<(Token, BodyMatrix)>,
    pub(super) harmonic: Harmonic,
    /// Gradient of each output over displacements, about the last state whose noise was requested.
    pub(super) seen: Option<(Token, Vec<OutputGradient>)>,
    pub(super) response: Vec<ComplexPose>,
    /// Codes of previous warnings, and the size of each.
    pub(super) warned: Vec<(String, f64)>,
    /// How what was accepted rings.
    pub(super) ringing: PhaseErrorMonitor,
    /// How fast the last trial's motion grows at fixed voltages.
    pub(super) growth: Growth,
    pub(super) difference: Difference,
    /// The motion that all trials of the point at hand lie about.
    pub(super) held: HeldMotion,
    /// Multirate integration; none for mechanisms without macro steps.
    pub(super) multirate: Option<Box<Multirate>>,
    /// Position of the current trial in a macro step.
    pub(super) position: Option<Box<MacroStepPosition>>,
    /// Offset of the displayed motion after a step without macro steps.
    pub(super) offset: Option<Box<DisplayOffset>>,
    /// Whether the current trial exceeds the error bound of a macro step.
    pub(super) exceeds_bound: bool,
}

/// Doubles for each port and body: stages, displacements, velocities, and those of states that are kept.
const DOUBLES: usize = 64;

impl DeviceSession {
    /// `known` is a reduced model of the same ports, if one was trained before.
    pub(super) fn open(
        compiled: &CompiledModel,
        request: &OpenRequest,
        known: Option<&Arc<CircuitReduction>>,
    ) -> Result<(Self, Description), DeviceError> {
        let ports = OpenedPorts::find(compiled, &request.ports)?;
        let own = ports.system.clone();
        let system = own.as_deref().unwrap_or(&compiled.parts.system);
        let electrics = &system.electrics;
        let signals: Vec<Expression<Signal>> = (request.signals.iter())
            .map(|name| {
                budget::check();
                Expression::of_state(compiled, name)
            })
            .collect::<Result<_, _>>()?;
        let mut description = describe(compiled, request, (&ports, &signals), electrics);
        let n = system.bodies();
        // each port has its sensitivity in every stage of a step, and matrices of ports and signals go with every reply
        budget::lay_out_matrix(ports.len(), DOUBLES * n + 4 * ports.len() + 2 * signals.len());
        let heaters = electrics.heating.states();
        let first_step = first_step(system, f64::INFINITY);
        let joints = match &compiled.joints {
            Some(Ok(joints)) => Some(ports.joints(joints)),
            Some(Err(unfit)) => {
                return Err(DeviceError::BadRequest {
                    what: "formulation",
                    expected: format!("one that suits this mechanism ({unfit})"),
                    got: compiled.options.formulation.name().into(),
                });
            }
            None => None,
        };
        let shaken = match &request.noise {
            Some(noise) => Some(ThermalForce::new(noise, compiled, surroundings(compiled))?),
            None => None,
        };
        let names: Vec<String> = description.ports.iter().map(|port| port.name.clone()).collect();
        let asked = (shaken.is_some(), first_step);
        let found = (&names[..], &ports.sources[..], &ports.kinds[..]);
        let reduction = SessionReduction::requested(compiled, system, found, asked, known);
        let (reduction, full_because) = reduction.map_or_else(|why| (None, Some(why)), |found| (found, None));
        let method = match &reduction {
            Some(found) => Formulated::reduced(found.model.method(), system, &ports.sources),
            None => Formulated::new(system, joints.as_ref(), first_step, &ports.sources),
        };
        description.unknowns = reduction.as_ref().map_or(description.unknowns, |found| found.model.space.size());
        let held = HeldMotion::new(n, ports.len(), (heaters, electrics.heating.means()));
        let sees_rates = sees_rates(&signals, &ports);
        let own = reduction.as_ref().map(|found| found.model.method());
        let stepper = MacroStepper::new(&method, own, system);
        let multirate = stepper.and_then(|stepper| Multirate::new(system, sees_rates, stepper, first_step));
        let multirate = multirate.map(Box::new);
        let session = Self {
            held,
            multirate,
            position: None,
            offset: None,
            exceeds_bound: false,
            opened: request.clone(),
            shaken,
            stepper: Adaptive::new(n, method),
            reduction,
            full_because,
            takes_bodies: false,
            weights: NormWeights::new(&system.model),
            ports,
            signals,
            states: States::default(),
            first_step,
            equilibrium: Equilibrium::new(system, EquilibriumOptions::with_side(compiled.options.other_branch)),
            motion: Motion::zeros(n),
            rise: electrics.heating.rest(),
            rise_slope: vec![0.0; heaters],
            sources: vec![0.0; electrics.sources()],
            unit: vec![0.0; electrics.sources()],
            drive: electrics.drive(),
            capacitances: Vec::with_capacity(electrics.gap_rows.nrows()),
            change: electrics.drive(),
            linear: None,
            harmonic: Harmonic::new(system),
            seen: None,
            response: vec![ComplexPose::zeros(); n],
            warned: Vec::new(),
            ringing: PhaseErrorMonitor::default(),
            growth: Growth::default(),
            difference: Difference::new(n),
        };
        Ok((session, description))
    }

    /// Whether a state has the sizes and the sense that one of this session has.
    pub(super) fn fits(&self, state: &Snapshot) -> bool {
        let n = self.motion.q.len();
        let poses = |poses: &[Pose]| poses.len() == n && poses.iter().all(|p| p.iter().all(|x| x.is_finite()));
        let numbers = |numbers: &[f64], count: usize| numbers.len() == count && numbers.iter().all(|x| x.is_finite());
        let carried = self.stepper.method.layout();
        let finite = |poses: &[Pose]| poses.iter().all(|p| p.iter().all(|x| x.is_finite()));
        let alike = |(a, b): (&Motion, &Motion)| {
            a.q.len() == b.q.len() && a.v.len() == b.v.len() && finite(&a.q) && finite(&a.v)
        };
        let followed = state.shown.followed();
        poses(&state.q)
            && poses(&state.v)
            && numbers(&state.rise, self.rise.len())
            && numbers(&state.sources, self.sources.len())
            && (state.anchors.is_empty() || numbers(&state.anchors, self.equilibrium.sticking.anchors().len()))
            && state.next_step > 0.0
            && state.peak.displacement >= 0.0
            && state.peak.rate >= 0.0
            && (state.origin.is_empty() || poses(&state.origin))
            && (0.0..f64::INFINITY).contains(&state.elapsed)
            && state.shown.numbers().into_iter().flatten().all(|x| x.is_finite())
            && (followed == 0 || followed == self.signals.len() + self.ports.len())
            && state.macro_step.as_ref().is_none_or(|position| self.fits_in(position))
            && state.offset.as_ref().is_none_or(|offset| {
                let DisplayOffset { start, length, elapsed } = &**offset;
                self.multirate.is_some()
                    && poses(&start.q)
                    && poses(&start.v)
                    && length.is_finite()
                    && (0.0..*length).contains(elapsed)
            })
            && (state.carried.is_empty()
                || state.carried.len() == carried.len() && state.carried.iter().zip(carried).all(alike))
    }

    /// Whether a position in a macro step has the sizes of this session, and finite values.
    fn fits_in(&self, position: &MacroStepPosition) -> bool {
        let MacroStepPosition { step, elapsed, integrals, .. } = position;
        let n = self.motion.q.len();
        let Some(voltages) = self.multirate.as_ref().map(|multirate| multirate.voltages()) else { return false };
        let numbers = [step.trial_step, step.peak.displacement, step.peak.rate, *elapsed];
        let squares = step.extrapolations.iter().flat_map(|e| [e.mean, e.value, e.slope]);
        let poses = [&step.motion.q, &step.motion.v, &step.displayed.q, &step.displayed.v];
        poses.iter().all(|poses| poses.len() == n && poses.iter().all(|p| p.iter().all(|x| x.is_finite())))
            && step.sources.len() == self.sources.len()
            && step.extrapolations.len() == voltages
            && integrals.len() == voltages
            && step.sources.iter().chain(&numbers).chain(integrals.as_flattened()).all(|x| x.is_finite())
            && squares.into_iter().all(f64::is_finite)
            && step.trial_step > 0.0
            && *elapsed > 0.0
    }

    /// The state that a small signal is about.
    pub(super) fn about(&mut self, token: Token, omega: f64) -> Result<Arc<Snapshot>, DeviceError> {
        if !omega.is_finite() || omega < 0.0 {
            return Err(DeviceError::BadRequest {
                what: "omega",
                expected: "a finite angular frequency of at least 0 rad/s".into(),
                got: omega.to_string(),
            });
        }
        self.states.get(token).ok_or(DeviceError::UnknownToken(token))
    }

    pub(super) fn check(&self, request: &Trial<'_>) -> Result<(), DeviceError> {
        if request.voltages.len() != self.ports.len() {
            return Err(DeviceError::BadRequest {
                what: "voltages",
                expected: format!("{} values, one for each opened port", self.ports.len()),
                got: request.voltages.len().to_string(),
            });
        }
        if let Some(v) = request.voltages.iter().find(|v| !v.is_finite()) {
            return Err(DeviceError::BadRequest {
                what: "voltages",
                expected: "finite numbers".into(),
                got: v.to_string(),
            });
        }
        if request.mode == Mode::Transient && !(request.dt.is_finite() && request.dt > 0.0) {
            return Err(DeviceError::BadRequest {
                what: "dt",
                expected: "a positive time in seconds".into(),
                got: request.dt.to_string(),
            });
        }
        Ok(())
    }

    /// The model as it was opened, with the inputs among its ports.
    pub(super) fn system<'a>(own: &'a Option<Arc<System>>, compiled: &'a CompiledModel) -> &'a System {
        own.as_deref().unwrap_or(&compiled.parts.system)
    }

    /// Fills in the source vector: opened ports as asked, the others at 0, the netlist's own sources.
    pub(super) fn fill_sources(&mut self, electrics: &Electrics, given: &[f64]) {
        self.sources.fill(0.0);
        self.sources[electrics.ports..electrics.voltages()].copy_from_slice(&electrics.fixed);
        for (&port, &value) in self.ports.sources.iter().zip(given) {
            self.sources[port] = value;
        }
    }
}

/// Description of what a request opens.
fn describe(
    compiled: &CompiledModel,
    request: &OpenRequest,
    (ports, signals): (&OpenedPorts, &[Expression<Signal>]),
    electrics: &Electrics,
) -> Description {
    Description {
        ports: if request.ports.is_empty() {
            let name = |&source: &usize| electrics.names[source].clone();
            ports.sources.iter().map(|p| PortInfo { name: name(p), kind: PortKind::Electrical }).collect()
        } else {
            let kinds = request.ports.iter().zip(&ports.kinds);
            kinds.map(|(name, &kind)| PortInfo { name: name.clone(), kind }).collect()
        },
        signals: (request.signals.iter().zip(signals))
            .map(|(name, s)| SignalInfo { name: name.clone(), unit: s.unit().into() })
            .collect(),
        unknowns: compiled.unknowns(),
    }
}

/// Whether a signal or port shows a rate.
fn sees_rates(signals: &[Expression<Signal>], ports: &OpenedPorts) -> bool {
    let of_ports = ports.answers.iter().filter_map(|answer| match answer {
        PortResponse::Motion(signal) => Some(signal),
        _ => None,
    });
    let is_rate = |signal: &Signal| matches!(signal, Signal::Rate(..));
    signals.iter().flat_map(Expression::quantities).chain(of_ports).any(is_rate)
}
