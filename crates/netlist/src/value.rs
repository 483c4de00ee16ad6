//! Values of netlist expressions.

use bimorph_structure::{Material, PropertyCurve};
use std::ops::Deref;
use std::sync::{Arc, OnceLock};

/// A value of the language.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) enum Value {
    Number(f64),
    Text(Arc<str>),
    /// A property against temperature.
    Curve(Arc<PropertyCurve>),
    /// An argument that was left open (`?`).
    #[default]
    Undefined,
    /// The value of something that failed and was reported: using it is no second error.
    Failed,
}

impl Value {
    /// How messages call its type.
    pub(crate) fn called(&self) -> &'static str {
        match self {
            Self::Number(_) => "a number",
            Self::Text(_) => "a string",
            Self::Curve(_) => "a curve over temperature",
            Self::Undefined => "undefined",
            Self::Failed => "invalid",
        }
    }
}

impl From<bool> for Value {
    fn from(truth: bool) -> Self {
        Self::Number(f64::from(u8::from(truth)))
    }
}

/// As `print` shows it: numbers with six significant digits, as C's `%g`.
impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(x) => f.write_str(&short(*x)),
            Self::Text(text) => f.write_str(text),
            Self::Curve(curve) => {
                let numbers = curve.table.iter().flatten().chain(&curve.polynomial).map(|x| short(*x));
                let name = if curve.table.is_empty() { "polynomial" } else { "table" };
                write!(f, "{name}({})", numbers.collect::<Vec<_>>().join(", "))
            }
            Self::Undefined => f.write_str("*undef*"),
            Self::Failed => f.write_str("*error*"),
        }
    }
}

/// A number with six significant digits, without trailing zeros.
pub(crate) fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let scientific = format!("{x:.5e}");
    let (digits, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-4..6).contains(&exponent) {
        let decimals = usize::try_from(5 - exponent).unwrap_or(0);
        let fixed = format!("{x:.decimals$}");
        return if fixed.contains('.') { fixed.trim_end_matches('0').trim_end_matches('.').to_owned() } else { fixed };
    }
    format!("{}e{exponent}", digits.trim_end_matches('0').trim_end_matches('.'))
}

/// A layer's entries, evaluated: its own before its parent's.
#[derive(Debug, Default)]
pub(crate) struct Entries<'p> {
    all: Vec<(&'p str, Value)>,
    /// The material that they make, once it has been read.
    pub(crate) material: OnceLock<Material>,
}

impl<'p> From<Vec<(&'p str, Value)>> for Entries<'p> {
    fn from(all: Vec<(&'p str, Value)>) -> Self {
        Self { all, material: OnceLock::new() }
    }
}

impl<'p> Deref for Entries<'p> {
    type Target = [(&'p str, Value)];

    fn deref(&self) -> &Self::Target {
        &self.all
    }
}

/// Those of a layer that elements share.
pub(crate) type LayerValues<'p> = Arc<Entries<'p>>;
