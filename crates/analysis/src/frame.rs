//! Statics, modes and motion of a linear frame of cubic beam elements: the baseline that stands for SUGAR.
//!
//! Same drawing, same materials, same heat; small displacements and constant matrices. Results have the form of those of the
//! product's own analyses. Gaps act with their nonlinear forces on the linear frame, as SUGAR's do, in statics and in modes about that
//! equilibrium; a motion in time refuses voltages across them, and stops are left out.

mod motion;

use super::modes::{ModesResult, normalized};
use super::statics::{NodeMotion, StaticResult, electrical, source_vector};
use super::{AnalysisError, BeamMotions, NodeMotions, PortVoltages};
use bimorph_domains::{Configuration, Domain, Drive, MaterialPoint, Member};
use bimorph_model::compile::CompiledModel;
use bimorph_model::discretize::frame::{ElementCount, FrameGaps, FrameOptions, LinearFrame, assemble};
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::planar::Pose;
use bimorph_solve::SolveError;
use bimorph_solve::baseline::frame_modes::lowest_consistent_modes;
use bimorph_solve::baseline::sparse::Sparse;
use bimorph_solve::linear::LinearSolver;

pub use motion::frame_transient;

/// Newton iterations of an equilibrium, at most.
const MAX_ITERATIONS: usize = 100;
/// Iterations after which a correction that does not shrink is rounding, where gaps pull.
const FEW: usize = 20;
/// Changes below this fraction of the displacements count as zero.
const SETTLED: f64 = 1e-12;

/// The frame of a compiled netlist: one element for each beam, as SUGAR has it, or by the band when one was given.
///
/// # Errors
/// [`AnalysisError::BadRequest`] for drawings that make no frame.
pub fn frame(compiled: &CompiledModel) -> Result<LinearFrame, AnalysisError> {
    let options = &compiled.options;
    let elements =
        options.band.map_or(ElementCount::Each(1), |band| ElementCount::Band(band, options.errors().requested()));
    let elements = options.segments.map_or(elements, ElementCount::Each);
    let gaps = FrameGaps::Laid { chord: options.as_sugar };
    frame_with(compiled, &FrameOptions { elements, shear: options.shear, undamped: options.undamped, gaps })
}

/// The frame with a given choice of elements.
///
/// # Errors
/// [`AnalysisError::BadRequest`] for drawings that make no frame.
pub fn frame_with(compiled: &CompiledModel, options: &FrameOptions) -> Result<LinearFrame, AnalysisError> {
    assemble(&compiled.structure, options)
        .map_err(|e| AnalysisError::BadRequest { what: "frame".into(), detail: e.to_string() })
}

/// Static equilibrium under loads, heat and gaps, and the displacement of points along every beam.
///
/// # Errors
/// See [`AnalysisError`].
pub fn frame_statics(
    compiled: &CompiledModel,
    frame: &LinearFrame,
    voltages: &PortVoltages,
) -> Result<(StaticResult, BeamMotions), AnalysisError> {
    let (sources, rise, drive) = sources(compiled, voltages)?;
    let (q, iterations) = balance(compiled, frame, &rise, &drive.volts)?;
    let nodes = node_motions(compiled, frame, &q);
    let electrics = &compiled.parts.system.electrics;
    let charge = |port: usize| {
        let gaps = frame.gaps.iter().zip(&drive.volts).enumerate();
        gaps.map(|(g, (gap, volts))| electrics.gap_rows[(g, port)] * gap.capacitance(drawn(&q)) * volts).sum::<f64>()
    };
    let electrical = electrical(compiled, &sources, &rise);
    let result = StaticResult {
        nodes,
        temperatures_k: electrical.temperatures_k,
        stresses_pa: Vec::new(),
        nominal_stresses_pa: Vec::new(),
        anchor_forces: Vec::new(),
        peak_temperatures_k: electrical.peak_temperatures_k,
        currents_a: electrical.currents_a,
        charges_c: (0..electrics.ports).map(|p| (electrics.names[p].clone(), charge(p))).collect(),
        pulled_in: false,
        jumped: false,
        passed: Vec::new(),
        free_motions: Vec::new(),
        unknowns: frame.system.unknowns(),
        estimated_error: None,
        warnings: Vec::new(),
        iterations,
    };
    Ok((result, beam_motions(frame, &q)))
}

/// Undamped modes about the drawn geometry, or where there are voltages across gaps about the equilibrium under those; and for each the displacement of points along every beam.
///
/// # Errors
/// See [`AnalysisError`].
pub fn frame_modes(
    compiled: &CompiledModel,
    frame: &LinearFrame,
    count: usize,
    voltages: &PortVoltages,
) -> Result<(ModesResult, Vec<BeamMotions>), AnalysisError> {
    let (_, rise, drive) = sources(compiled, voltages)?;
    let mut system = frame.system.clone();
    if drive.volts.iter().any(|volts| *volts != 0.0) {
        let (q, _) = balance(compiled, frame, &rise, &drive.volts)?;
        add_gap_stiffness(frame, &q, &drive.volts, &mut system.stiffness);
    }
    let found = lowest_consistent_modes(&system, count).map_err(|p| singular(frame, p))?;
    let shape = |x: &Vec<Pose>| normalized(node_motions(compiled, frame, x), beam_motions(frame, x));
    let (shapes, curves) = found.shapes.iter().map(shape).unzip();
    let result = ModesResult {
        per_deflection: Vec::new(),
        estimated_error: None,
        frequencies_hz: found.lambda.iter().map(|&l| l.max(0.0).sqrt() / std::f64::consts::TAU).collect(),
        shapes,
        errors: vec![None; found.residuals.len()],
        residuals: found.residuals,
        unknowns: frame.system.unknowns(),
        deflection_m: 0.0,
        warnings: Vec::new(),
    };
    Ok((result, curves))
}

/// Source voltages, steady rises, and what they drive.
fn sources(compiled: &CompiledModel, voltages: &PortVoltages) -> Result<(Vec<f64>, Vec<f64>, Drive), AnalysisError> {
    let electrics = &compiled.parts.system.electrics;
    let sources = source_vector(compiled, voltages)?;
    if let Some(k) = (electrics.voltages()..sources.len()).find(|k| sources[*k] != 0.0) {
        return Err(AnalysisError::BadRequest {
            what: format!("port \"{}\"", electrics.names[k]),
            detail: "the linear frame moves its anchors as drawn alone; give the displacement as anchorx, anchory or anchorrz".into(),
        });
    }
    let mut rise = vec![0.0; electrics.heating.states()];
    let mut drive = electrics.drive();
    electrics.steady(&sources, &mut rise, &mut drive);
    if !electrics.floating.is_empty() && drive.volts.iter().any(|volts| *volts != 0.0) {
        return Err(AnalysisError::BadRequest {
            what: "frame".into(),
            detail: "a conductor between gaps floats, which the linear frame has not; connect it with `R` or `eground`, or leave out \
                     the voltage"
                .into(),
        });
    }
    Ok((sources, rise, drive))
}

/// Source voltages and steady rises; refuses voltages that would act across gaps.
fn steady(compiled: &CompiledModel, voltages: &PortVoltages) -> Result<(Vec<f64>, Vec<f64>), AnalysisError> {
    let (sources, rise, drive) = sources(compiled, voltages)?;
    if let Some(gap) = drive.volts.iter().position(|v| *v != 0.0) {
        return Err(AnalysisError::BadRequest {
            what: "frame".into(),
            detail: format!(
                "{} carries {} V; the linear frame moves in time without electrostatic forces",
                compiled.parts.gap_names[gap], drive.volts[gap]
            ),
        });
    }
    Ok((sources, rise))
}

/// Forces of loads, built-in strains and heat.
fn force(compiled: &CompiledModel, frame: &LinearFrame, rise: &[f64], out: &mut [Pose]) {
    out.copy_from_slice(&frame.load);
    let heating = &compiled.parts.system.electrics.heating;
    for (k, unit) in frame.expansion.iter().enumerate() {
        let strain = heating.strain(k, rise);
        for (f, unit) in out.iter_mut().zip(unit) {
            *f += unit * strain;
        }
    }
}

/// The equilibrium with these voltages across the gaps, from the drawing by Newton's method, and its iterations.
fn balance(
    compiled: &CompiledModel,
    frame: &LinearFrame,
    rise: &[f64],
    volts: &[f64],
) -> Result<(Vec<Pose>, usize), AnalysisError> {
    let system = &frame.system;
    let mut load = vec![Pose::zeros(); system.bodies()];
    force(compiled, frame, rise, &mut load);
    let mut solver = Sparse::new(&system.pattern)?;
    let mut q = vec![Pose::zeros(); system.bodies()];
    let (mut tangent, mut before) = (system.clone(), f64::INFINITY);
    let size = compiled.structure.extent();
    for iteration in 1..=MAX_ITERATIONS {
        tangent.stiffness.clone_from(&system.stiffness);
        let mut change = load.clone();
        let mut borne = vec![Pose::zeros(); system.bodies()];
        system.stiffness.multiply_add(&system.pattern, &q, &mut borne);
        for (gap, volts) in acting(frame, volts) {
            gap.add_force(drawn(&q), volts, &mut borne);
        }
        change.iter_mut().zip(&borne).for_each(|(change, borne)| *change -= borne);
        add_gap_stiffness(frame, &q, volts, &mut tangent.stiffness);
        tangent.project(&mut change);
        let mut matrix = tangent.combine(1.0, 0.0, 0.0);
        // the recursion's test of pivots finds free motions; the solution itself is the sparse package's
        let inertia = matrix.clone().factor(&system.pattern).map_err(|p| singular(frame, p))?;
        solver.factor(&system.pattern, &mut matrix).map_err(|p| singular(frame, p))?;
        solver.solve(&system.pattern, &matrix, &mut change);
        q.iter_mut().zip(&change).for_each(|(q, change)| *q += change);
        let (moved, all) = (amount(&change, size), amount(&q, size));
        let settled = moved <= SETTLED * all;
        if settled && inertia.negative > 0 {
            let detail = "Newton's method from the drawing came to an equilibrium of the frame that is unstable: the voltages across its gaps are \
                          beyond pull-in, or a load holds a gap open; take --solver recursion, which follows the branch"
                .into();
            return Err(AnalysisError::NotConverged { detail });
        }
        if settled {
            return Ok((q, iteration));
        }
        // a correction that does not shrink any more is rounding
        if moved > 0.5 * before && (iteration > FEW || acting(frame, volts).next().is_none()) {
            // what is printed is within the tolerance beside it
            if moved <= compiled.options.errors().within(all) {
                return Ok((q, iteration));
            }
            break;
        }
        before = moved;
    }
    Err(AnalysisError::NotConverged {
        detail: "the frame finds no equilibrium: its gaps have pulled in, or rounding hides where a part rests that next to nothing holds"
            .into(),
    })
}

/// Largest translation, or rotation times the drawing's size (m).
fn amount(q: &[Pose], size: f64) -> f64 {
    q.iter().map(|p| p.fixed_rows::<2>(0).amax().max(size * p[2].abs())).fold(0.0, f64::max)
}

/// The gaps with a voltage across them.
fn acting<'a>(frame: &'a LinearFrame, volts: &'a [f64]) -> impl Iterator<Item = (&'a Member, f64)> {
    frame.gaps.iter().zip(volts.iter().copied()).filter(|(_, volts)| *volts != 0.0)
}

/// Small displacements about the drawing.
fn drawn(q: &[Pose]) -> Configuration<'_> {
    Configuration { q, linear: true }
}

/// Adds what the field in the gaps does to the stiffness at `q`, contact with it.
fn add_gap_stiffness(frame: &LinearFrame, q: &[Pose], volts: &[f64], stiffness: &mut BodyMatrix) {
    for (gap, volts) in acting(frame, volts) {
        gap.add_tangent(drawn(q), volts, &frame.system.pattern, stiffness);
    }
}

fn singular(frame: &LinearFrame, pivot: ZeroPivot) -> AnalysisError {
    let (body, direction) = (frame.system.names[pivot.body].clone(), bimorph_solve::DIRECTIONS[pivot.direction]);
    SolveError::Singular { body, direction }.into()
}

fn node_motions(compiled: &CompiledModel, frame: &LinearFrame, q: &[Pose]) -> NodeMotions {
    (compiled.structure.nodes.iter().zip(&frame.nodes))
        .filter_map(|(node, point)| Some((node.name.clone(), motion(&(*point)?, q))))
        .collect()
}

fn beam_motions(frame: &LinearFrame, q: &[Pose]) -> BeamMotions {
    frame.beams.iter().map(|points| points.iter().map(|p| motion(p, q)).collect()).collect()
}

fn motion(point: &MaterialPoint, q: &[Pose]) -> NodeMotion {
    let moved = point.displacement(q, true);
    NodeMotion { x: moved.x, y: moved.y, rz: point.rotation(q) }
}
