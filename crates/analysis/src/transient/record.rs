//! A run from its start to its end, with its samples, crossings, and stability checks.

use super::super::contact_range::within_contact_range;
use super::super::stability::StabilityMonitor;
use super::super::statics::{check_motion, notes_at, operating_point, source_vector};
use super::super::{AnalysisError, ProgressCallback};
use super::contact_energy::ContactEnergy;
use super::crossings::Crossings;
use super::error_log::{ErrorLog, SignalLoss};
use super::film_pressure::FilmPressure;
use super::folded_segments;
use super::options::{TransientOptions, check};
use super::peak_stress::PeakStress;
use super::result::TransientResult;
use super::samples::SampleRecorder;
use crate::overheating::check_course;
use crate::readout::expression::Expression;
use crate::readout::run_signal::RunSignal;
use bimorph_domains::{Drive, InputWaveform, Ramp, System};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::Body;
use bimorph_multibody::planar::Pose;
use bimorph_solve::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph_solve::path::SourcePath;
use bimorph_solve::time::adaptive::{Advance, Observer};
use bimorph_solve::time::defect::{MotionError, SeeError};
use bimorph_solve::time::method::{Motion, SolverCounters};

/// Times of a run at which its stability is checked, the end included.
pub(crate) const STABILITY_CHECKS: usize = 16;

/// Part of a way to contact (1) below which equal steps are too short for an impact in a stage.
const NEAR: f64 = 0.5;

/// Propagates a motion from the start of a ramp to its end.
pub(crate) trait Propagator {
    /// Moves the start to a state from which the formulation can continue.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn begin(&mut self, ramp: &Ramp<'_>, motion: &mut Motion) -> Result<(), AnalysisError> {
        let _ = (ramp, motion);
        Ok(())
    }

    /// Advances it; `observe` sees each step, and `errors` the error of the motion at its end where the method propagates it.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    fn advance(
        &mut self,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        observe: Observer<'_>,
        errors: Option<SeeError<'_>>,
    ) -> Result<(Advance, SolverCounters), AnalysisError>;
}

/// The start of a run: its motion, sources and signals.
pub(crate) struct RunStart {
    sources: Vec<f64>,
    signals: Vec<Expression<RunSignal>>,
    motions: Vec<(usize, InputWaveform)>,
    /// The motion.
    pub(crate) motion: Motion,
    /// Temperature rises of the heaters (K).
    rise: Vec<f64>,
    /// Warnings about the equilibrium that it is released from.
    begun: Vec<String>,
}

impl RunStart {
    /// # Errors
    /// [`AnalysisError::BadRequest`] for options that mean nothing, and those of the equilibrium that the run is released from.
    pub(crate) fn of(compiled: &CompiledModel, options: &TransientOptions<'_>) -> Result<Self, AnalysisError> {
        check(options)?;
        let sources = source_vector(compiled, &options.voltages)?;
        let signals = options
            .signals
            .iter()
            .map(|name| Expression::of_run(compiled, name, &sources))
            .collect::<Result<_, _>>()?;
        let (motion, rise, begun) = start(compiled, options)?;
        Ok(Self { sources, signals, motions: motions(compiled, options)?, motion, rise, begun })
    }

    /// Sources and heat over the run.
    ///
    /// # Errors
    /// [`AnalysisError`] where heaters leave all bounds.
    pub(crate) fn ramp<'a>(
        &'a self,
        compiled: &'a CompiledModel,
        options: &TransientOptions<'_>,
    ) -> Result<Ramp<'a>, AnalysisError> {
        let (sources, stop) = (&self.sources, options.stop);
        let ramp = Ramp::new(&compiled.parts.system.electrics, sources, sources, &self.rise, stop);
        let ramp = ramp.shocked(options.shock).moved(&self.motions);
        check_course(compiled, &ramp)?;
        Ok(ramp)
    }
}

/// Takes samples and events of a run, and checks its stability and its range, step by step.
pub(crate) struct Recording<'a> {
    compiled: &'a CompiledModel,
    options: &'a TransientOptions<'a>,
    start: &'a RunStart,
    ramp: &'a Ramp<'a>,
    volts: &'a [f64],
    drive: Drive,
    crossings: Crossings<'a>,
    samples: SampleRecorder<'a>,
    stability: StabilityMonitor,
    energy: Option<ContactEnergy<'a>>,
    stress: PeakStress<'a>,
    gas: FilmPressure<'a>,
    /// Checks of stability so far.
    looks: usize,
    /// Why the run ended before its end.
    beyond: Option<AnalysisError>,
    stopped_at: Option<f64>,
}

impl<'a> Recording<'a> {
    /// Of a run from `motion`, under voltages that hold.
    ///
    /// # Errors
    /// [`AnalysisError::BadRequest`] for signals of events that do not exist, and for a start in contact with a method that gains energy there.
    pub(crate) fn start(
        (compiled, options): (&'a CompiledModel, &'a TransientOptions<'a>),
        start: &'a RunStart,
        (ramp, volts): (&'a Ramp<'a>, &'a [f64]),
        sample: &'a mut dyn FnMut(f64, &[f64]),
        motion: &Motion,
    ) -> Result<Self, AnalysisError> {
        let system = &compiled.parts.system;
        let (asked, held) = ((compiled, options), (ramp, volts));
        let crossings = Crossings::start(asked, (&start.sources, held), (motion, &start.rise))?;
        let mut drive = system.electrics.drive();
        ramp.at(0.0, &mut drive);
        let samples = SampleRecorder::start(asked, held, &start.signals, sample, motion);
        let energy = ContactEnergy::start(compiled, options, motion, &drive);
        refuse_in_contact(compiled, options, 0.0, motion)?;
        Ok(Self {
            compiled,
            options,
            start,
            ramp,
            volts,
            drive,
            crossings,
            samples,
            stability: StabilityMonitor::new(system),
            energy,
            stress: PeakStress::new(compiled, held, options.shock.is_some()),
            gas: FilmPressure::new(system),
            looks: 0,
            beyond: None,
            stopped_at: None,
        })
    }

    /// Takes a step of length `h` (s) from time `s`; false: the run ends there.
    pub(crate) fn step(&mut self, s: f64, h: f64, before: &Motion, after: &Motion) -> bool {
        let Self { compiled, options, ramp, volts, .. } = *self;
        let system = &compiled.parts.system;
        self.stopped_at = self.crossings.step(s, h, before, after);
        self.gas.step(s + h, after);
        self.stress.step(s + h, after);
        let suits = refuse_in_contact(compiled, options, s + h, after);
        let within = |()| within_contact_range(compiled, &after.q, |gap| volts[gap] != 0.0);
        let done = ((s + h) / options.stop * STABILITY_CHECKS as f64 * (1.0 + 1e-12)) as usize;
        let look = done > self.looks || options.step.is_some() && !self.crossings.stays_within(NEAR);
        let kept = |()| self.energy.as_mut().map_or(Ok(()), |energy| energy.step(options, s + h, after, look));
        // energy first: steps that are too long throw parts through each other
        let ended = suits.and_then(kept).and_then(within);
        if let Err(error) = ended.or_else(|error| self.stopped_at.map(|_| ()).ok_or(error)) {
            self.beyond = Some(error);
            return false;
        }
        self.samples.step(s, h, before, after, self.stopped_at.unwrap_or(f64::INFINITY));
        if self.stopped_at.is_some() {
            return false;
        }
        if done > self.looks {
            self.looks = done;
            ramp.at(s + h, &mut self.drive);
            self.stability.check(system, &self.drive, s + h, (&after.q, &after.v));
        }
        true
    }

    /// The result of a run that ended so with this work; `log` has its errors, where it propagates them.
    ///
    /// # Errors
    /// Why it ended before its end.
    pub(crate) fn finish(
        self,
        end: Advance,
        work: SolverCounters,
        log: Option<ErrorLog<'_>>,
    ) -> Result<TransientResult, AnalysisError> {
        let Self { compiled, options, start, stopped_at, stability, stress, gas, samples, .. } = self;
        if end == Advance::Stopped && stopped_at.is_none() {
            return Err(self.beyond.unwrap_or(AnalysisError::Cancelled));
        }
        let estimate = log.and_then(|log| log.estimate(options));
        let unreached = options.until.as_ref().filter(|_| stopped_at.is_none()).map(|until| {
            format!("the run does not reach its end condition ({until}) by {:e} s; take a longer --stop", options.stop)
        });
        let named = options.signals.iter().zip(&start.signals).zip(samples.columns);
        Ok(TransientResult {
            t: samples.t,
            signals: named.map(|((name, s), values)| (name.clone(), s.unit().to_owned(), values)).collect(),
            counters: work,
            unknowns: compiled.unknowns(),
            estimated_error: compiled.order.estimated_error,
            step_error: estimate.as_ref().map(|estimate| estimate.error),
            damped: estimate.as_ref().map(|estimate| estimate.damped),
            stopped_at,
            reliable_until: None,
            after_contact: Vec::new(),
            events: self.crossings.events,
            largest_stress: stress.largest(),
            directions: None,
            formulation_taken: None,
            warnings: (start.begun.iter().cloned())
                .chain(stability.warning())
                .chain(gas.warning())
                .chain(stress.warning())
                .chain(estimate.and_then(|e| e.lost).map(lost))
                .chain(unreached)
                .collect(),
        })
    }
}

/// Advances `carrier` from the start to the end of a run, and takes samples and events.
pub(crate) fn record(
    compiled: &CompiledModel,
    options: &TransientOptions<'_>,
    carrier: &mut impl Propagator,
    sample: &mut dyn FnMut(f64, &[f64]),
    watch: ProgressCallback<'_>,
) -> Result<TransientResult, AnalysisError> {
    let start = RunStart::of(compiled, options)?;
    let ramp = start.ramp(compiled, options)?;
    let mut drive = compiled.parts.system.electrics.drive();
    ramp.at(0.0, &mut drive);
    let mut motion = start.motion.clone();
    carrier.begin(&ramp, &mut motion)?;
    let held = (&ramp, &drive.volts[..]);
    let mut log = options.estimate.then(|| ErrorLog::start((compiled, options.stop), held, &start.signals, &motion));
    let mut recording = Recording::start((compiled, options), &start, held, sample, &motion)?;
    let mut observe = |s: f64, h: f64, before: &Motion, after: &Motion| {
        recording.step(s, h, before, after) && watch(((s + h) / options.stop).min(1.0))
    };
    let mut errors =
        log.as_mut().map(|log| |t: f64, motion: &Motion, error: MotionError<'_>| log.observe(t, motion, error));
    let see = errors.as_mut().map(|see| see as SeeError<'_>);
    let (end, work) = carrier.advance(&ramp, &mut motion, &mut observe, see).map_err(|error| match error {
        AnalysisError::StepFailed { t, dt, detail } => {
            AnalysisError::StepFailed { t, dt, detail: detail + &folded_segments::addition(compiled, &motion.q) }
        }
        other => other,
    })?;
    recording.finish(end, work, log)
}

/// Refuses the motion at time `t` (s) where parts touch and the method gains energy in contact.
fn refuse_in_contact(
    compiled: &CompiledModel,
    options: &TransientOptions<'_>,
    t: f64,
    motion: &Motion,
) -> Result<(), AnalysisError> {
    if !options.method.gains_in_contact() {
        return Ok(());
    }
    let system = &compiled.parts.system;
    let Some(gap) = (0..system.members.len()).find(|&g| system.touches(g, &motion.q)) else { return Ok(()) };
    let name = &compiled.parts.gap_names[gap];
    let method = options.method.name();
    Err(AnalysisError::BadRequest {
        what: format!("method {method}"),
        detail: format!(
            "the gap \"{name}\" touches at {t:.6e} s, and {method} gains energy without bound in contact; expected a method that does not: \
             rodas4 (default), radau5, sdirk4, tr-bdf2, or generalized-alpha with --rho 0, in steps that follow --tol; or avf"
        ),
    })
}

/// The warning of a signal that is lost.
fn lost(SignalLoss { signal, t, chaotic }: SignalLoss) -> String {
    match chaotic {
        true => format!(
            "{signal} is not predictable after {t:.2e} s: neighbouring motions part exponentially there, at any tolerance; only its statistics hold"
        ),
        false => format!(
            "the phase of {signal} is lost after {t:.2e} s: its step error exceeds 0.3 of its range; use a smaller --tol"
        ),
    }
}

/// Waveforms of driven anchors by their places among the inputs.
fn motions(
    compiled: &CompiledModel,
    options: &TransientOptions<'_>,
) -> Result<Vec<(usize, InputWaveform)>, AnalysisError> {
    // names, and values at the start
    source_vector(compiled, &options.at_start())?;
    let system = &compiled.parts.system;
    let place = |(name, wave): &(String, InputWaveform)| {
        let source = system.anchor_source(name).ok_or_else(|| AnalysisError::BadRequest {
            what: format!("motion \"{name}\""),
            detail: format!("expected NODE.ux, .uy or .urz of an anchor with `moves=1`, got \"{name}\""),
        })?;
        check_motion(compiled, (name, source), wave.farthest())?;
        Ok((source - system.electrics.voltages(), wave.clone()))
    };
    options.motions.iter().map(place).collect()
}

/// The equilibrium of built-in strains and moved anchors at the start of a run, without dead loads and voltages: anchors that jumped would send waves along
/// the beams. None where no anchor moves.
pub(crate) fn at_anchors(
    compiled: &CompiledModel,
    options: &TransientOptions<'_>,
) -> Result<Option<Vec<Pose>>, AnalysisError> {
    let system = &compiled.parts.system;
    let off = vec![0.0; system.electrics.sources()];
    let mut placed = source_vector(compiled, &options.at_start())?;
    placed[..system.electrics.voltages()].fill(0.0);
    if !compiled.structure.moves_anchors() && placed == off {
        return Ok(None);
    }
    let unloaded = System { loads: Vec::new(), ..system.clone() };
    let mut q = vec![Pose::zeros(); system.bodies()];
    let path = SourcePath::new(&unloaded.electrics, &off, &placed, [0.0, 1.0]);
    Equilibrium::new(&unloaded, EquilibriumOptions::default()).follow(&unloaded, &path, &mut q)?;
    Ok(Some(q))
}

/// Initial state of a run, temperature rises of its heaters (K), and warnings: at rest as drawn, in the equilibrium of moved anchors, or in that
/// of a released load.
fn start(
    compiled: &CompiledModel,
    options: &TransientOptions<'_>,
) -> Result<(Motion, Vec<f64>, Vec<String>), AnalysisError> {
    let system = &compiled.parts.system;
    let still = |b: &Body| b.mass == 0.0 && b.inertia == 0.0 && b.drag.amount == 0.0;
    if system.model.dampers.is_empty() && system.model.bodies.iter().all(still) {
        return Err(AnalysisError::BadRequest {
            what: "motion in time".into(),
            detail: "nothing that moves has mass or drag; give the layer a `density`, or use statics".into(),
        });
    }
    let mut motion = Motion::zeros(system.bodies());
    let mut rise = system.electrics.heating.rest();
    let mut reported = Vec::new();
    if let Some(start) = options.release {
        let point = operating_point(start, &options.at_start())?;
        let places = |model: &CompiledModel| model.structure.nodes.iter().map(|node| node.position).collect::<Vec<_>>();
        if point.q.len() != motion.q.len() || places(start) != places(compiled) {
            return Err(AnalysisError::BadRequest {
                what: "release".into(),
                detail: "the released parameter changes the mechanism itself; release a load or a voltage".into(),
            });
        }
        motion.q.copy_from_slice(&point.q);
        rise.copy_from_slice(&point.rise);
        reported = notes_at(start, &point);
    } else if let Some(q) = at_anchors(compiled, options)? {
        motion.q = q;
    }
    Ok((
        motion,
        rise,
        reported.into_iter().map(|way| format!("the equilibrium that it is released from: {way}")).collect(),
    ))
}
