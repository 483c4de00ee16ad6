//! Description of an option: its name, unit, default, range and meaning, once for all front ends.
//!
//! A front end reads user input as an [`OptionValue`] and passes it to [`OptionDescription::check`]; help, declarations
//! and tables come from here.

use super::choices::{Anchors, Formulation, FringeFields, Junctions, Scheme};
use super::port_ranges::PortRanges;
use std::fmt;
use thiserror::Error;

/// Value of an option of any type.
#[derive(Debug, Clone, PartialEq)]
pub enum OptionValue {
    /// Nothing: a rule decides, see [`OptionDescription::unset`].
    Unset,
    /// Yes or no.
    Flag(bool),
    /// A whole number.
    Count(usize),
    /// A number in the option's unit.
    Number(f64),
    /// One of a few names, or a text.
    Name(String),
}

impl fmt::Display for OptionValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unset => f.write_str("nothing"),
            Self::Flag(flag) => write!(f, "{flag}"),
            Self::Count(count) => write!(f, "{count}"),
            Self::Number(x) if *x == 0.0 || (1e-2..1e5).contains(&x.abs()) => write!(f, "{x}"),
            Self::Number(x) => write!(f, "{x:e}"),
            Self::Name(name) => write!(f, "\"{name}\""),
        }
    }
}

/// Range of an option.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// Yes or no.
    Flag,
    /// A whole number, both ends included.
    Count(usize, usize),
    /// A number above the first, at most the second; where the second is 1, below it.
    Above(f64, f64),
    /// A number, both ends included.
    Within(f64, f64),
    /// One of these names.
    Names(&'static [&'static str]),
    /// Ranges by name.
    Ranges,
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = |x: &f64| OptionValue::Number(*x);
        match self {
            Self::Flag => f.write_str("true or false"),
            Self::Count(low, high) => write!(f, "{low} to {high}"),
            Self::Above(low, high) if *high == 1.0 => write!(f, "above {}, below 1", number(low)),
            Self::Above(low, high) => write!(f, "above {}, at most {}", number(low), number(high)),
            Self::Within(low, high) => write!(f, "{} to {}", number(low), number(high)),
            Self::Names([first, second, third]) => write!(f, "{first}, {second} or {third}"),
            Self::Names(names) => f.write_str(&names.join(", ")),
            Self::Ranges => {
                f.write_str(
                    "NAME:LOW:HIGH with LOW below HIGH, finite and once for each port, separated by commas (in decks by bars)",
                )
            }
        }
    }
}

/// Description of an option for all front ends.
#[derive(Debug, Clone, PartialEq)]
pub struct OptionDescription {
    /// Its name in decks, in Python and in the library; on the command line with `-` for `_`.
    pub name: &'static str,
    /// Its field on the wire and its key in JSON documents, which say the unit where it is not 1.
    pub wire: &'static str,
    /// Its unit; empty where it has none, "1" for a ratio.
    pub unit: &'static str,
    /// Permitted values.
    pub range: Range,
    /// Default, unless a front end overrides it.
    pub default: OptionValue,
    /// Meaning of an unset value, for options without a default.
    pub unset: &'static str,
    /// Meaning, in one sentence or two.
    pub help: &'static str,
}

/// A value that an option cannot have.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{option}: expected {expected}, got {got}")]
pub struct OptionError {
    /// [`OptionDescription::name`].
    pub option: &'static str,
    /// The expected value, with its unit.
    pub expected: String,
    /// The given value.
    pub got: String,
}

impl OptionDescription {
    /// The name as the command writes it.
    pub fn flag(&self) -> String {
        self.name.replace('_', "-")
    }

    /// Its meaning, as one line.
    pub fn about(&self) -> String {
        self.help.split_whitespace().collect::<Vec<_>>().join(" ").trim_end_matches('.').to_owned()
    }

    /// The default in words.
    pub fn by_default(&self) -> String {
        match &self.default {
            OptionValue::Unset => self.unset.to_owned(),
            OptionValue::Name(name) => name.clone(),
            other => other.to_string(),
        }
    }

    /// The range in words, with its unit.
    pub fn expected(&self) -> String {
        let kind = match self.range {
            Range::Flag | Range::Names(_) | Range::Ranges => "",
            Range::Count(..) => "a whole number from ",
            Range::Above(..) => "a number ",
            Range::Within(..) => "a number from ",
        };
        let unit = if self.unit == "1" { "" } else { self.unit };
        format!("{kind}{} {unit}", self.range).trim_end().to_owned()
    }

    /// Whether `value` is of the right kind and within the range. The only place where options are compared with their
    /// bounds.
    ///
    /// # Errors
    /// [`OptionError`].
    pub fn check(&self, value: &OptionValue) -> Result<(), OptionError> {
        let fits = match (&self.range, value) {
            (_, OptionValue::Unset) => self.default == OptionValue::Unset,
            (Range::Flag, OptionValue::Flag(_)) => true,
            (Range::Count(low, high), OptionValue::Count(count)) => (low..=high).contains(&count),
            (Range::Above(low, high), OptionValue::Number(x)) => x > low && (x < high || *x == *high && *high != 1.0),
            (Range::Within(low, high), OptionValue::Number(x)) => (low..=high).contains(&x),
            (Range::Names(names), OptionValue::Name(name)) => names.contains(&name.as_str()),
            (Range::Ranges, OptionValue::Name(text)) => match PortRanges::parse(text) {
                Ok(_) => true,
                Err(got) => return Err(OptionError { option: self.name, expected: self.expected(), got }),
            },
            _ => false,
        };
        if fits {
            return Ok(());
        }
        Err(OptionError { option: self.name, expected: self.expected(), got: value.to_string() })
    }
}

/// A type that a field of the options may have.
pub(super) trait Field: Sized {
    /// As a value.
    fn value(&self) -> OptionValue;
    /// From a value that the table has found to fit.
    fn from_value(value: OptionValue) -> Option<Self>;
}

impl Field for bool {
    fn value(&self) -> OptionValue {
        OptionValue::Flag(*self)
    }

    fn from_value(value: OptionValue) -> Option<Self> {
        if let OptionValue::Flag(flag) = value { Some(flag) } else { None }
    }
}

impl Field for f64 {
    fn value(&self) -> OptionValue {
        OptionValue::Number(*self)
    }

    fn from_value(value: OptionValue) -> Option<Self> {
        if let OptionValue::Number(x) = value { Some(x) } else { None }
    }
}

impl Field for usize {
    fn value(&self) -> OptionValue {
        OptionValue::Count(*self)
    }

    fn from_value(value: OptionValue) -> Option<Self> {
        if let OptionValue::Count(count) = value { Some(count) } else { None }
    }
}

impl<T: Field> Field for Option<T> {
    fn value(&self) -> OptionValue {
        self.as_ref().map_or(OptionValue::Unset, T::value)
    }

    fn from_value(value: OptionValue) -> Option<Self> {
        if value == OptionValue::Unset { Some(None) } else { T::from_value(value).map(Some) }
    }
}

impl Field for PortRanges {
    fn value(&self) -> OptionValue {
        OptionValue::Name(self.text().to_owned())
    }

    fn from_value(value: OptionValue) -> Option<Self> {
        if let OptionValue::Name(text) = value { Self::parse(&text).ok() } else { None }
    }
}

macro_rules! named_field {
    ($($kind:ty),+) => {$(
        impl Field for $kind {
            fn value(&self) -> OptionValue {
                OptionValue::Name(self.name().to_owned())
            }

            fn from_value(value: OptionValue) -> Option<Self> {
                if let OptionValue::Name(name) = value { Self::named(&name) } else { None }
            }
        }
    )+};
}

named_field!(Scheme, Junctions, Anchors, FringeFields, Formulation);
