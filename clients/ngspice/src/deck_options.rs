//! The options of a model as parameters of a `.model` line.
//!
//! From version 43 on ngspice gives every number a value, so an option that is left to a rule reads 0 there: by the rule.

use bimorph::options::{CompileOptions, MODEL, ModelOption, Range, Refused, Value};

/// A value as a deck can write it.
#[derive(Debug, Clone, PartialEq)]
pub enum Written {
    /// `name=true`.
    Flag(bool),
    /// `name=1e-3`.
    Number(f64),
    /// `name="text"`.
    Text(String),
}

/// A parameter as it is declared to the host.
#[derive(Debug, Clone, PartialEq)]
pub struct Declared {
    /// Its name.
    pub name: &'static str,
    /// What it reads where the line does not say it.
    pub default: Written,
    /// What it means, with its unit.
    pub text: String,
}

/// The parameters, in the order of [`MODEL`].
pub fn declared() -> Vec<Declared> {
    let declare = |ModelOption { about, .. }: &ModelOption| {
        let unit = if matches!(about.unit, "" | "1") { String::new() } else { format!(" [{}]", about.unit) };
        let zero = if about.default == Value::Unset { format!("; 0: {}", about.unset) } else { String::new() };
        Declared {
            name: about.name,
            default: match (&about.default, about.range) {
                (Value::Unset, Range::Names(_)) => Written::Text(String::new()),
                (default, _) => written(default),
            },
            text: format!("{}{unit}{zero}", about.about()),
        }
    };
    MODEL.iter().map(declare).collect()
}

/// A value as a deck writes it.
pub fn written(value: &Value) -> Written {
    match value {
        Value::Unset => Written::Number(0.0),
        Value::Flag(flag) => Written::Flag(*flag),
        Value::Count(count) => Written::Number(*count as f64),
        Value::Number(x) => Written::Number(*x),
        Value::Name(name) => Written::Text(name.clone()),
    }
}

/// Gives an option what the deck says.
///
/// # Errors
/// [`Refused`]: a value that the option cannot have.
pub fn choose(options: &mut CompileOptions, option: &ModelOption, written: &Written) -> Result<(), Refused> {
    let unset = option.about.default == Value::Unset;
    let value = match (written, option.about.range) {
        (Written::Number(x), _) if unset && *x == 0.0 => Value::Unset,
        (Written::Text(text), _) if unset && text.is_empty() => Value::Unset,
        // a fraction stays a number, which no count is
        (Written::Number(x), Range::Count(..)) if *x >= 0.0 && x.fract() == 0.0 => Value::Count(*x as usize),
        (Written::Number(x), _) => Value::Number(*x),
        (Written::Flag(flag), _) => Value::Flag(*flag),
        // ngspice 39 turns the line to lower case, and no name has another
        (Written::Text(text), _) => Value::Name(text.to_ascii_lowercase()),
    };
    options.choose(option, value)
}
