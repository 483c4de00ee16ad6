//! The functions of the language. Angles are in radians.

use super::value::Value;
use bimorph_structure::PropertyCurve;
use std::sync::Arc;

/// Every function's name.
pub(crate) const NAMES: &[&str] = &[
    "abs",
    "acos",
    "asin",
    "assert",
    "atan",
    "atan2",
    "ceil",
    "cond",
    "cos",
    "deg",
    "exp",
    "floor",
    "isdef",
    "log",
    "log10",
    "max",
    "min",
    "mod",
    "polynomial",
    "print",
    "round",
    "sign",
    "sin",
    "sqrt",
    "table",
    "tan",
];

/// A function of one number.
fn unary(name: &str) -> Option<fn(f64) -> f64> {
    Some(match name {
        "abs" => f64::abs,
        "acos" => f64::acos,
        "asin" => f64::asin,
        "atan" => f64::atan,
        "ceil" => f64::ceil,
        "cos" => f64::cos,
        "deg" => |x| std::f64::consts::PI * (x / 180.0),
        "exp" => f64::exp,
        "floor" => f64::floor,
        "log" => f64::ln,
        "log10" => f64::log10,
        "round" => f64::round,
        "sign" => |x: f64| if x == 0.0 { 0.0 } else { x.signum() },
        "sin" => f64::sin,
        "sqrt" => f64::sqrt,
        "tan" => f64::tan,
        _ => return None,
    })
}

/// A function of two numbers. `mod` has the sign of its first argument, as SUGAR's.
fn binary(name: &str) -> Option<fn(f64, f64) -> f64> {
    Some(match name {
        "atan2" => f64::atan2,
        "max" => f64::max,
        "min" => f64::min,
        "mod" => |a, b| a % b,
        _ => return None,
    })
}

/// Applies a function that has no special rules of evaluation.
///
/// # Errors
/// The text says what was expected.
pub(crate) fn apply(name: &str, arguments: &[Value]) -> Result<Value, String> {
    if let Some(f) = unary(name) {
        return match arguments {
            [Value::Number(x)] => defined(f(*x), name),
            _ => Err(wrong(name, "one number", arguments)),
        };
    }
    if matches!(name, "polynomial" | "table") {
        return curve(name, arguments);
    }
    match binary(name) {
        Some(f) => match arguments {
            [Value::Number(a), Value::Number(b)] => defined(f(*a, *b), name),
            _ => Err(wrong(name, "two numbers", arguments)),
        },
        None => Err(format!("unknown function `{name}`")),
    }
}

/// A property against temperature: a table of pairs, or a polynomial.
fn curve(name: &str, arguments: &[Value]) -> Result<Value, String> {
    let number = |value: &Value| if let Value::Number(x) = value { Some(*x) } else { None };
    let numbers: Option<Vec<f64>> = arguments.iter().map(number).collect();
    let curve = match (numbers, name) {
        (Some(polynomial), "polynomial") if !polynomial.is_empty() => {
            PropertyCurve { polynomial, ..PropertyCurve::default() }
        }
        (Some(numbers), "table") if numbers.len() >= 4 && numbers.len().is_multiple_of(2) => {
            let table = numbers.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
            PropertyCurve { table, ..PropertyCurve::default() }
        }
        (_, "polynomial") => return Err(wrong(name, "coefficients", arguments)),
        _ => return Err(wrong(name, "two or more pairs of a temperature [K] and a value", arguments)),
    };
    match curve.fault() {
        Some(fault) => Err(format!("`{name}`: {fault}")),
        None => Ok(Value::Curve(Arc::new(curve))),
    }
}

fn defined(value: f64, name: &str) -> Result<Value, String> {
    if value.is_nan() { Err(format!("`{name}` has no real value here")) } else { Ok(Value::Number(value)) }
}

/// The message for arguments that do not fit.
pub(crate) fn wrong(name: &str, wanted: &str, got: &[Value]) -> String {
    let got: Vec<&str> = got.iter().map(Value::called).collect();
    let got = if got.is_empty() { "nothing".to_owned() } else { got.join(", ") };
    format!("`{name}` takes {wanted}, got {got}")
}
