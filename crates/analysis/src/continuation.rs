//! Equilibrium paths: the equilibria of a mechanism under a growing load, voltage, temperature or stress, past folds
//! and through bifurcations.
use super::contact_range::{comb_beyond_reported, within_contact_range};
use super::statics::{OperatingPoint, beam_motions, node_motions, notes_at, operating_point, source_vector, too_hot};
use super::{AnalysisError, BeamMotions, NodeMotions, ProgressCallback};
use crate::readout::expression::Expression;
use crate::readout::signal::{Signal, SignalView};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::planar::Pose;
use bimorph_solve::continuation::{Branch, Continuation, ContinuationOptions, PathEnd, PathEvent, TracedPath};
use bimorph_solve::family::LoadFamily;
use serde::Serialize;

/// Parameter of a path.
#[derive(Debug, Clone)]
pub enum PathInput<'a> {
    /// Voltage of a port, by name.
    Port(&'a str),
    /// A netlist parameter; the netlist compiled with its last value.
    Parameter(&'a CompiledModel),
    /// The factor on all dead loads.
    Loads,
}

/// Request for a path.
#[derive(Debug, Clone)]
pub struct ContinuationRequest<'a> {
    /// Parameter of the path.
    pub input: PathInput<'a>,
    /// Its first value [V, the parameter's unit, or 1]. The path starts at the equilibrium there.
    pub from: f64,
    /// Its last value.
    pub to: f64,
    /// Voltages held on the other ports, by name (V).
    pub voltages: Vec<(String, f64)>,
    /// Signals wanted along the path, see [`Expression::of_state`].
    pub signals: Vec<String>,
    /// Treatment of a bifurcation at which the path loses its stability.
    pub branch: Branch,
    /// Most points.
    pub points: usize,
}

/// A fold or bifurcation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CriticalPoint {
    /// Value of what grows.
    pub value: f64,
    /// Index of its point.
    pub point: usize,
}

/// A traced path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContinuationResult {
    /// Value of what grows at each point, in the order of the path.
    pub values: Vec<f64>,
    /// Signals along the path: (name, unit, values).
    pub signals: Vec<(String, String, Vec<f64>)>,
    /// Negative eigenvalues of the stiffness at each point: 0 where stable under fixed loads and voltages.
    pub negative: Vec<usize>,
    /// Where the value turns back.
    pub folds: Vec<CriticalPoint>,
    /// Where other paths cross.
    pub bifurcations: Vec<CriticalPoint>,
    /// Why the path ends.
    pub end: &'static str,
    /// Displacement of every node at the last point, by name.
    pub last: NodeMotions,
    /// The same along every beam.
    #[serde(skip)]
    pub last_curves: BeamMotions,
    /// Mechanical unknowns.
    pub unknowns: usize,
    /// Newton iterations.
    pub iterations: usize,
    /// Warnings about the path.
    #[serde(skip)]
    pub warnings: Vec<String>,
}

/// Traces the path of equilibria from the one at `from`.
///
/// # Errors
/// See [`AnalysisError`].
pub fn trace(
    compiled: &CompiledModel,
    request: &ContinuationRequest<'_>,
    watch: ProgressCallback<'_>,
) -> Result<ContinuationResult, AnalysisError> {
    let bad = |what: &str, detail: String| AnalysisError::BadRequest { what: what.to_owned(), detail };
    if !(request.from.is_finite() && request.to.is_finite() && request.from != request.to) {
        return Err(bad(
            "along",
            format!("what grows has to go from one value to another, not from {} to {}", request.from, request.to),
        ));
    }
    let signals: Vec<Expression<Signal>> =
        request.signals.iter().map(|name| Expression::of_state(compiled, name)).collect::<Result<_, _>>()?;
    let mut volts = [request.voltages.clone(), request.voltages.clone()];
    let mut last = compiled;
    match request.input {
        PathInput::Port(name) => {
            for (volts, value) in volts.iter_mut().zip([request.from, request.to]) {
                volts.retain(|(port, _)| port != name);
                volts.push((name.to_owned(), value));
            }
        }
        PathInput::Parameter(to) => last = to,
        PathInput::Loads => {}
    }
    let system = &compiled.parts.system;
    let sources = [source_vector(compiled, &volts[0])?, source_vector(last, &volts[1])?];
    let mut family = LoadFamily::new(system, &sources[0], &last.parts.system, &sources[1])
        .map_err(|e| bad("along", e.to_string()))?;
    let start = if matches!(request.input, PathInput::Loads) {
        family.scale_loads([request.from, request.to]);
        let mut first = compiled.clone();
        first.parts.system = family.system().clone();
        operating_point(&first, &volts[0])?
    } else {
        operating_point(compiled, &volts[0])?
    };
    let options =
        ContinuationOptions { branch: request.branch, points: request.points, ..ContinuationOptions::default() };
    let mut tracer = Continuation::new(system, options);
    let bytes = size_of::<Pose>() * system.bodies() + size_of::<f64>() * (signals.len() + 2);
    let traced = tracer.trace(&mut family, &start.q, &mut |s| {
        bimorph_base::budget::lay_out(bytes);
        watch(s.clamp(0.0, 1.0))
    })?;
    if traced.end == PathEnd::Stopped {
        return Err(AnalysisError::Cancelled);
    }

    let energised = |gap: usize| sources.iter().any(|u| system.electrics.is_energised(gap, u));
    for point in &traced.points {
        within_contact_range(compiled, &point.q, energised)?;
    }
    let value = |s: f64| if s == 1.0 { request.to } else { request.from + s * (request.to - request.from) };
    let mut columns: Vec<Vec<f64>> = vec![Vec::with_capacity(traced.points.len()); signals.len()];
    let zeros = vec![Pose::zeros(); system.bodies()];
    let (mut u, mut rise, mut drive) = (sources[0].clone(), start.rise.clone(), system.electrics.drive());
    for point in &traced.points {
        for (u, (a, b)) in u.iter_mut().zip(sources[0].iter().zip(&sources[1])) {
            *u = a + point.s * (b - a);
        }
        system.electrics.steady(&u, &mut rise, &mut drive);
        let view = SignalView { q: &point.q, v: &zeros, rise: &rise, volts: &drive.volts };
        for (column, signal) in columns.iter_mut().zip(&signals) {
            column.push(signal.value(compiled, &view));
        }
    }
    let critical = |kind: PathEvent| -> Vec<CriticalPoint> {
        let of_kind = traced.events.iter().filter(|(event, _)| *event == kind);
        of_kind.map(|&(_, point)| CriticalPoint { value: value(traced.points[point].s), point }).collect()
    };
    let mut warnings = path_notes(compiled, &start, &sources, &traced);
    warnings.extend(event_notes(&traced, value));
    Ok(ContinuationResult {
        values: traced.points.iter().map(|p| value(p.s)).collect(),
        signals: (request.signals.iter().zip(&signals).zip(columns))
            .map(|((name, signal), column)| (name.clone(), signal.unit().to_owned(), column))
            .collect(),
        negative: traced.points.iter().map(|p| p.negative).collect(),
        folds: critical(PathEvent::Fold),
        bifurcations: critical(PathEvent::Bifurcation),
        end: match traced.end {
            PathEnd::Arrived => "arrived",
            PathEnd::TurnedBack => "turned back",
            PathEnd::Unstable => "unstable",
            PathEnd::Full => "as many points as allowed",
            PathEnd::Lost => "lost",
            PathEnd::Stopped => "stopped",
        },
        last: traced.points.last().map(|p| node_motions(compiled, &p.q)).unwrap_or_default(),
        last_curves: traced.points.last().map(|p| beam_motions(compiled, &p.q)).unwrap_or_default(),
        unknowns: system.model.unknowns(),
        iterations: traced.iterations,
        warnings,
    })
}

/// Warnings about the equilibrium where a path starts, the first point at which a comb is beyond its range, and the
/// hottest point.
fn path_notes(
    compiled: &CompiledModel,
    start: &OperatingPoint,
    [from, to]: &[Vec<f64>; 2],
    traced: &TracedPath,
) -> Vec<String> {
    let electrics = &compiled.parts.system.electrics;
    let mut drive = electrics.drive();
    let mut hot = |s: f64| {
        let sources: Vec<f64> = from.iter().zip(to).map(|(a, b)| a + s * (b - a)).collect();
        let mut rise = start.rise.clone();
        electrics.steady(&sources, &mut rise, &mut drive);
        too_hot(compiled, &OperatingPoint { rise, sources, ..start.clone() })
    };
    let begins = |way: String| format!("the equilibrium that it starts from: {way}");
    let farthest = traced.points.iter().map(|p| p.s).fold(0.0, f64::max);
    notes_at(compiled, start)
        .into_iter()
        .map(begins)
        .chain(traced.points.iter().find_map(|point| comb_beyond_reported(compiled, &point.q)))
        .chain(hot(0.0).or_else(|| hot(farthest)))
        .collect()
}

/// Warnings about a path whose points have these values.
fn event_notes(traced: &TracedPath, value: impl Fn(f64) -> f64) -> Vec<String> {
    let at = |point: &usize| value(traced.points[*point].s);
    let rough = traced.rough.iter().map(|point| {
        format!("the path was lost next to the fold or bifurcation at {:.4e}, which is not located closely", at(point))
    });
    let stayed = traced.stayed.iter().map(|point| {
        format!("no branch was found at the bifurcation at {:.4e}: the path goes straight on, unstable", at(point))
    });
    rough.chain(stayed).collect()
}
