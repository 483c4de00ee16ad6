//! The options of a model as parameters of a `.model` line.
//!
//! From version 43 on ngspice gives every number a value, so an option that is left to a rule reads 0 there: by the rule.

use bimorph::options::{CompileOptions, MODEL, ModelOption, OptionError, OptionValue, Range};

/// A value as a deck can write it.
#[derive(Debug, Clone, PartialEq)]
pub enum DeckValue {
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
    /// Value where the line omits it.
    pub default: DeckValue,
    /// Meaning, with its unit.
    pub text: String,
}

/// The parameters, in the order of [`MODEL`].
pub fn declared() -> Vec<Declared> {
    let declare = |ModelOption { about, .. }: &ModelOption| {
        let unit = if matches!(about.unit, "" | "1") { String::new() } else { format!(" [{}]", about.unit) };
        let zero = if about.default == OptionValue::Unset { format!("; 0: {}", about.unset) } else { String::new() };
        Declared {
            name: about.name,
            default: match (&about.default, about.range) {
                (OptionValue::Unset, Range::Names(_) | Range::Ranges) => DeckValue::Text(String::new()),
                (default, _) => written(default),
            },
            text: format!("{}{unit}{zero}", about.about()),
        }
    };
    MODEL.iter().map(declare).collect()
}

/// A value as a deck writes it.
pub fn written(value: &OptionValue) -> DeckValue {
    match value {
        OptionValue::Unset => DeckValue::Number(0.0),
        OptionValue::Flag(flag) => DeckValue::Flag(*flag),
        OptionValue::Count(count) => DeckValue::Number(*count as f64),
        OptionValue::Number(x) => DeckValue::Number(*x),
        OptionValue::Name(name) => DeckValue::Text(name.clone()),
    }
}

/// Gives an option what the deck says.
///
/// # Errors
/// [`OptionError`]: a value that the option cannot have.
pub fn choose(options: &mut CompileOptions, option: &ModelOption, written: &DeckValue) -> Result<(), OptionError> {
    let unset = option.about.default == OptionValue::Unset;
    let value = match (written, option.about.range) {
        (DeckValue::Number(x), _) if unset && *x == 0.0 => OptionValue::Unset,
        (DeckValue::Text(text), _) if unset && text.is_empty() => OptionValue::Unset,
        // a fraction stays a number, which no count is
        (DeckValue::Number(x), Range::Count(..)) if *x >= 0.0 && x.fract() == 0.0 => OptionValue::Count(*x as usize),
        (DeckValue::Number(x), _) => OptionValue::Number(*x),
        (DeckValue::Flag(flag), _) => OptionValue::Flag(*flag),
        (DeckValue::Text(text), Range::Ranges) => OptionValue::Name(text.clone()),
        // ngspice 39 turns the line to lower case, and no name has another
        (DeckValue::Text(text), _) => OptionValue::Name(text.to_ascii_lowercase()),
    };
    options.choose(option, value)
}
