//! Axis of a sweep: a parameter of the netlist, the voltage of a port, or an option of the model.

use super::error::{SweepError, bad};
use super::values::Values;
use bimorph_base::Setting;
use bimorph_model::options::{CompileOptions, MODEL, ModelOption, OptionValue, Range};
use bimorph_structure::is_anchor_motion;

/// Suffix of a port's name that makes the name of an axis of its voltages: `heat.v`. No netlist parameter has a point
/// in its name.
pub(super) const VOLTS: &str = ".v";
/// Prefix of an option's name that makes the name of an axis of its values: `option.tol`.
const OPTION: &str = "option.";

/// One axis of the grid, or of several that go together.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepParameter {
    /// A netlist parameter; a port with `.v` behind it: its voltage (V); the motion `NODE.ux`, `.uy` or `.urz` of a driven anchor (m, rad); an option of the model with `option.` before it.
    pub name: String,
    /// The values it takes, in order. SI.
    pub values: Values,
    /// True: it is no axis of its own. It takes its first value where the one before it has its first, and so on: a list of points.
    pub in_step: bool,
}

/// Kind of an axis.
#[derive(Clone, Copy)]
pub(super) enum Varied<'a> {
    Parameter,
    /// A port, or the motion of an anchor.
    Voltage(&'a str),
    /// An option, by its name.
    Option(&'a str),
}

/// Kind of an axis.
pub(super) fn varied(name: &str) -> Varied<'_> {
    match (name.strip_suffix(VOLTS), name.strip_prefix(OPTION)) {
        (Some(port), _) => Varied::Voltage(port),
        (None, None) if is_anchor_motion(name) => Varied::Voltage(name),
        (None, Some(option)) => Varied::Option(option),
        (None, None) => Varied::Parameter,
    }
}

impl SweepParameter {
    /// The name of the option that it varies; none for anything else.
    pub(super) fn option(&self) -> Option<&str> {
        if let Varied::Option(option) = varied(&self.name) { Some(option) } else { None }
    }

    /// Refuses values that what it names cannot have.
    ///
    /// # Errors
    /// [`SweepError::BadSpec`] for an invalid voltage, an unknown option, and a value out of range.
    pub(super) fn check(&self) -> Result<(), SweepError> {
        let what = || format!("parameter \"{}\"", self.name);
        if let Values::Linear { low, high, .. } = self.values
            && !(high - low).is_finite()
        {
            return Err(bad(what(), "two ends with a finite distance", &format!("{low:e} and {high:e}")));
        }
        match varied(&self.name) {
            Varied::Parameter => Ok(()),
            Varied::Voltage(_) if self.values.iter().any(|value| matches!(value, Setting::Text(_))) => {
                Err(bad(what(), "voltages [V]", "a word"))
            }
            Varied::Voltage(_) => Ok(()),
            Varied::Option(name) => {
                let Some(option) = named(name) else {
                    let names: Vec<&str> = MODEL.iter().map(|option| option.about.name).collect();
                    return Err(bad(
                        what(),
                        &format!("{OPTION} and one of {}", names.join(", ")),
                        &format!("\"{name}\""),
                    ));
                };
                let mut options = CompileOptions::default();
                let refused =
                    self.values.iter().find_map(|value| options.choose(option, value_of(option, &value)).err());
                refused.map_or(Ok(()), |refused| Err(bad(what(), &refused.expected, &refused.got)))
            }
        }
    }
}

/// Options with the values that parameters of the netlist have at a point.
pub(super) fn at(options: &CompileOptions, settings: &[(String, Setting)]) -> CompileOptions {
    let parameter = |(name, _): &&(String, Setting)| matches!(varied(name), Varied::Parameter);
    options.with_settings(&settings.iter().filter(parameter).cloned().collect::<Vec<_>>())
}

/// Options with those that vary as they are at a point.
pub(super) fn chosen(options: &CompileOptions, settings: &[(String, Setting)]) -> CompileOptions {
    let mut options = options.clone();
    for (name, value) in settings {
        if let Varied::Option(name) = varied(name)
            && let Some(option) = named(name)
        {
            // a value that is refused has been refused with its axis
            options = options.with_choice(option, value_of(option, value)).unwrap_or(options);
        }
    }
    options
}

fn named(name: &str) -> Option<&'static ModelOption> {
    MODEL.iter().find(|option| option.about.name == name)
}

/// A setting as a value of an option; one that does not fit becomes one that the option refuses.
fn value_of(option: &ModelOption, setting: &Setting) -> OptionValue {
    match (option.about.range, setting) {
        (Range::Count(..), Setting::Number(x)) if x.fract() == 0.0 && (0.0..=9e15).contains(x) => {
            OptionValue::Count(*x as usize)
        }
        (Range::Flag, Setting::Text(text)) if text == "true" || text == "false" => OptionValue::Flag(text == "true"),
        (_, Setting::Number(x)) => OptionValue::Number(*x),
        (_, Setting::Text(text)) => OptionValue::Name(text.clone()),
    }
}
