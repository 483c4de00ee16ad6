//! Motion of a linear frame in time, by Newmark's rule.

use super::super::transient::options::{TransientOptions, check};
use super::super::transient::result::TransientResult;
use super::super::{AnalysisError, ProgressCallback};
use super::{balance, force, singular, steady};
use crate::readout::ReadoutError;
use crate::readout::expression::{Expression, Quantity};
use crate::readout::signal::{Signal, SignalView, node_signal};
use bimorph_domains::{MaterialPoint, Ramp};
use bimorph_model::compile::CompiledModel;
use bimorph_model::discretize::frame::LinearFrame;
use bimorph_multibody::planar::Pose;
use bimorph_solve::baseline::frame_motion::Newmark;
use bimorph_solve::baseline::sparse::Sparse;
use bimorph_solve::time::method::SolverCounters;

/// Steps between two output times are doubled until the motion settles, up to this many.
const MAX_STEPS: usize = 1 << 14;
/// Linear motion in time by Newmark's rule. The step is halved until the signals change by less than the tolerance.
///
/// # Errors
/// See [`AnalysisError`]; `NotConverged` when even the shortest steps do not settle.
pub fn frame_transient(
    compiled: &CompiledModel,
    frame: &LinearFrame,
    options: &TransientOptions<'_>,
    watch: ProgressCallback<'_>,
) -> Result<TransientResult, AnalysisError> {
    check(options)?;
    let (sources, _) = steady(compiled, &options.voltages)?;
    let states = compiled.parts.system.electrics.heating.states();
    let zeros = vec![Pose::zeros(); frame.system.bodies()];
    let (start, rise) = match options.release {
        Some(initial) => {
            let before = super::frame(initial)?;
            if before.system.bodies() != zeros.len() {
                return Err(AnalysisError::BadRequest {
                    what: "release".into(),
                    detail: "the released parameter changes the mechanism itself; release a load or a voltage".into(),
                });
            }
            let (_, rise) = steady(initial, &options.voltages)?;
            (balance(initial, &before, &rise, &[])?.0, rise)
        }
        None => (zeros.clone(), vec![0.0; states]),
    };
    let find = |text: &String| Expression::find(text, |name| FrameSignal::find(compiled, frame, name));
    let signals: Vec<Expression<FrameSignal>> = options.signals.iter().map(find).collect::<Result<_, _>>()?;
    let electrics = &compiled.parts.system.electrics;
    let ramp = Ramp::new(electrics, &sources, &sources, &rise, options.stop);
    let spacing = options.stop / (options.points - 1) as f64;
    let mut counters = SolverCounters::default();
    let mut run = |between: usize, counters: &mut SolverCounters| -> Result<Vec<Vec<f64>>, AnalysisError> {
        let solver = Sparse::new(&frame.system.pattern)?;
        let h = spacing / between as f64;
        let mut rule = Newmark::new(solver, &frame.system, h).map_err(|p| singular(frame, p))?;
        counters.factorizations += 1;
        let (mut q, mut v) = (start.clone(), zeros.clone());
        let (mut before, mut after, mut rises) = (zeros.clone(), zeros.clone(), rise.clone());
        force(compiled, frame, &rise, &mut before);
        let mut rows = vec![Vec::with_capacity(options.points); signals.len()];
        let mut sample = |q: &[Pose], v: &[Pose], rise: &[f64]| {
            for (row, signal) in rows.iter_mut().zip(&signals) {
                row.push(signal.sum(|one| one.value(compiled, q, v, rise)));
            }
        };
        sample(&q, &v, &rise);
        for k in 1..options.points {
            for i in 1..=between {
                let t = (k - 1) as f64 * spacing + i as f64 * h;
                for (heater, r) in rises.iter_mut().enumerate() {
                    *r = ramp.rise_at(heater, t);
                }
                force(compiled, frame, &rises, &mut after);
                rule.step(&frame.system, &before, &after, &mut q, &mut v);
                std::mem::swap(&mut before, &mut after);
            }
            counters.steps += between as u64;
            counters.solves += between as u64;
            sample(&q, &v, &rises);
            if !watch(k as f64 / options.points as f64) {
                return Err(AnalysisError::Cancelled);
            }
        }
        Ok(rows)
    };
    let mut between = 1;
    let mut coarse = run(between, &mut counters)?;
    let rows = loop {
        between *= 2;
        let fine = run(between, &mut counters)?;
        // the rule is of second order: the error of the finer run is a third of the difference
        let error = coarse.iter().zip(&fine).map(|(a, b)| change(a, b) / 3.0).fold(0.0, f64::max);
        if options.errors().holds(error) {
            break fine;
        }
        if between >= MAX_STEPS {
            return Err(AnalysisError::NotConverged {
                detail: format!("steps of {:.1e} s still change the signals by {error:.1e}", spacing / between as f64),
            });
        }
        coarse = fine;
    };
    let t =
        (0..options.points).map(|k| if k + 1 == options.points { options.stop } else { k as f64 * spacing }).collect();
    let signals = (options.signals.iter().zip(&signals).zip(rows))
        .map(|((name, signal), row)| (name.clone(), signal.unit().to_owned(), row))
        .collect();
    Ok(TransientResult { t, signals, counters, unknowns: frame.system.unknowns(), ..TransientResult::default() })
}

/// Largest change of a signal between two runs, against its largest value.
fn change(a: &[f64], b: &[f64]) -> f64 {
    let amplitude = b.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let apart = a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
    if amplitude > 0.0 { apart / amplitude } else { 0.0 }
}

/// A quantity of a frame.
#[derive(Debug)]
enum FrameSignal {
    /// Displacement of a node: direction 0 x, 1 y, 2 rotation; or its rate.
    Node { point: MaterialPoint, direction: usize, rate: bool },
    /// Mean temperature of a beam, as the product's own signal has it.
    Temperature(Signal),
}

impl Quantity for FrameSignal {
    fn unit(&self) -> &'static str {
        match self {
            Self::Node { direction: 2, rate: false, .. } => "rad",
            Self::Node { direction: 2, rate: true, .. } => "rad/s",
            Self::Node { rate: false, .. } => "m",
            Self::Node { rate: true, .. } => "m/s",
            Self::Temperature(_) => "K",
        }
    }
}

impl FrameSignal {
    fn find(compiled: &CompiledModel, frame: &LinearFrame, name: &str) -> Result<Self, ReadoutError> {
        if let Some((node, direction, rate)) = node_signal(compiled, name)
            && let Some(point) = frame.nodes[node]
        {
            return Ok(Self::Node { point, direction, rate });
        }
        match Signal::find(compiled, name)? {
            signal @ (Signal::Temperature(_) | Signal::Prescribed(_)) => Ok(Self::Temperature(signal)),
            _ => Err(ReadoutError::UnknownSignal {
                name: name.to_owned(),
                hint: "the linear frame knows the motion of nodes and the temperature of beams".into(),
            }),
        }
    }

    fn value(&self, compiled: &CompiledModel, q: &[Pose], v: &[Pose], rise: &[f64]) -> f64 {
        match self {
            Self::Node { point, direction, rate } => {
                let x = if *rate { v } else { q };
                if *direction == 2 { point.rotation(x) } else { point.displacement(x, true)[*direction] }
            }
            Self::Temperature(signal) => signal.value(compiled, &SignalView { q: &[], v: &[], rise, volts: &[] }),
        }
    }
}
