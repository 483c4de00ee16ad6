//! Warnings from fitting a model to a request.

use super::super::contact_range::comb_beyond_reported;
use super::super::reduced::WARNING as REDUCED;
use super::super::rotary_inertia_error;
use super::super::statics::{OperatingPoint, SofteningCause, too_hot, too_stressed};
use bimorph_base::Diagnostic;
use bimorph_base::ErrorBudget;
use bimorph_model::compile::CompiledModel;

/// Code of the warning that a mesh does not hold the tolerance.
pub const WARNING: &str = "W040";
/// Code of the warning that beams along a gap have too few segments for what a circuit does to them.
const SEGMENTS: &str = "W042";
/// Code of the warning that a linear model leaves out what its stress does.
const STRESS: &str = "W041";
/// Code of the warning that the fingers of a comb go through its other side.
const FINGERS: &str = "W024";
/// Code of the warning that a beam is stressed beyond its strength.
const STRENGTH: &str = "W051";
/// Code of the warning that nothing is solid at a temperature.
const HEAT: &str = "W037";
/// Code of the warning that the steps of a run are longer than what it begins with.
const STEPS: &str = "W044";
/// Code of the warning that an equilibrium is close to buckling or pull-in.
const BUCKLING: &str = "W046";
/// Code of the warning that rotary inertia is left out.
const ROTARY: &str = "W045";

/// Warnings from fitting a model to a request, as sentences for callers without another channel.
pub fn warnings(fitted: &CompiledModel) -> impl Iterator<Item = String> {
    fitted
        .warnings
        .items
        .iter()
        .filter(|d| {
            [WARNING, STRESS, SEGMENTS, FINGERS, HEAT, STRENGTH, STEPS, ROTARY, BUCKLING, REDUCED]
                .contains(&d.code.as_str())
        })
        .map(|d| d.message.clone())
}

/// Warning about an estimate beyond the tolerance, or a missing one.
pub fn beyond(budget: ErrorBudget, estimated_error: Option<f64>) -> Option<String> {
    match estimated_error {
        Some(error) if !budget.is_exceeded(error) => None,
        Some(error) if error.is_finite() => Some(format!(
            "the estimated error of the mesh is {error:.1e}, more than the tolerance {:e}",
            budget.requested()
        )),
        // on twice the segments something is there that was not, or the other way round
        _ => Some(format!("the error of the mesh is unknown: the tolerance {:e} is not confirmed", budget.requested())),
    }
}

/// Warning about omitted stress stiffening of a linear model, where its effect exceeds the tolerance.
pub(super) fn of_stress(compiled: &CompiledModel, share: Option<f64>) -> Option<Diagnostic> {
    let share = share.filter(|share| *share > compiled.options.errors().requested())?;
    let message = if share.is_finite() {
        format!(
            "the linear model leaves out what stress does to stiffness: it would change the deflection by {share:.1e}"
        )
    } else {
        "the linear model leaves out what stress does to stiffness: the part would buckle".into()
    };
    Some(Diagnostic::warning(STRESS, message, "leave --linear away; modes have the stiffness of stress with it too"))
}

/// Where the fingers of a comb go through its other side at an equilibrium.
pub(super) fn of_fingers(compiled: &CompiledModel, point: &OperatingPoint) -> Option<Diagnostic> {
    let message = comb_beyond_reported(compiled, &point.q)?;
    Some(Diagnostic::warning(FINGERS, message, "draw the `stop2d` that holds the part, or longer fingers"))
}

/// Where equal steps (s) are longer than a radian of a motion that a run begins with, of a frequency (Hz) and a fraction of the way.
pub(super) fn of_steps(step: f64, (frequency, share): (f64, f64)) -> Diagnostic {
    let message = format!(
        "steps of {step:e} s are longer than a radian of the motion at {frequency:.4e} Hz, which has {:.0} % of the way that the run begins with: \
         they damp it away or slow it, and no comparison of steps shows that",
        100.0 * share
    );
    let help = format!("take a --step of {:.1e} s or less, or none", 0.2 / (std::f64::consts::TAU * frequency));
    Diagnostic::warning(STEPS, message, &help)
}

/// Warning about a waveform error of this size from missing rotary inertia of wide beams.
pub(super) fn of_rotary(compiled: &CompiledModel, error: f64) -> Option<Diagnostic> {
    if error <= compiled.options.errors().requested().max(rotary_inertia_error::WORTH) {
        return None;
    }
    let message =
        format!("rotary inertia of wide beams is neglected: the estimated error is {error:.1e} of the amplitude");
    Some(Diagnostic::warning(ROTARY, message, "take --rotary-inertia"))
}

/// Where an equilibrium is so close to buckling or pull-in that its load decides on less than the accuracy of dimensions.
pub(super) fn near_buckling(point: &OperatingPoint) -> Option<Diagnostic> {
    let (beam, cause) = point.near_buckling.as_ref()?;
    let (limit, help) = match cause {
        SofteningCause::Voltage => (
            "the voltages are within 1 % of pull-in",
            "`bimorph pullin` finds that voltage; `bimorph path` shows the branches",
        ),
        SofteningCause::Stress => (
            "the load is within 1 % of buckling",
            "`bimorph path` shows the branches; --imperfection gives the part a shape that is not ideal",
        ),
        SofteningCause::Both => (
            "load and voltages together are within 1 % of a loss of stability",
            "`bimorph path` shows the branches; --imperfection gives the part a shape that is not ideal",
        ),
    };
    let softest = if beam.is_empty() { String::new() } else { format!("; softest motion: beam {beam}") };
    Some(Diagnostic::warning(BUCKLING, format!("{limit}{softest}"), help))
}

/// Where current makes a beam hotter than any solid bears.
pub(super) fn of_heat(compiled: &CompiledModel, point: &OperatingPoint) -> Option<Diagnostic> {
    let message = too_hot(compiled, point)?;
    Some(Diagnostic::warning(HEAT, message, "volts, not millivolts; `thermcond` in W/m/K, `sheetresistance` in Ω"))
}

/// Where the stress in a beam exceeds its strength.
pub(super) fn of_strength(compiled: &CompiledModel, point: &OperatingPoint) -> Option<Diagnostic> {
    let message = too_stressed(compiled, point)?;
    Some(Diagnostic::warning(STRENGTH, message, "a wider or longer beam, less travel, or a stop before it"))
}

/// Where segments are too long for the field along them, with the gap that leaves out most and the error of the deflection (1).
pub(super) fn of_segments(compiled: &CompiledModel, worst: &(String, f64)) -> Option<Diagnostic> {
    let (name, error) = worst;
    if compiled.options.errors().holds(*error) {
        return None;
    }
    let message = if error.is_finite() {
        format!(
            "segments along `{name}`: estimated error of the deflection {error:.1e}, tolerance {:e}",
            compiled.options.errors().requested()
        )
    } else {
        format!("segments along `{name}`: the gap may pull in at this voltage with more of them")
    };
    Some(Diagnostic::warning(SEGMENTS, message, "give the model more `segments`"))
}
