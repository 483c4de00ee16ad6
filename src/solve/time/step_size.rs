//! How long the next step is: the rule that every driver with error control shares (Hairer & Wanner 1996, §IV.8).
//!
//! Errors are relative to what a step may make, and fall with the p-th power of the step; `exponent` is −1/p.

/// Aim for this share of the step that would just be allowed.
const SAFETY: f64 = 0.9;

/// What to try where `h` is wanted and `left` remains: the last two steps share what is left, so that no sliver remains.
pub(super) fn fitted(h: f64, left: f64) -> f64 {
    if h >= 0.999 * left { left } else { h.min(0.5 * left.max(h)) }
}

/// What to want after a `step` with this `error` was accepted where `h` had been wanted. A step cut short by the end of the
/// interval says nothing against the longer one.
pub(super) fn accepted(h: f64, step: f64, error: f64, exponent: f64) -> f64 {
    let grown = (SAFETY * error.max(1e-10).powf(exponent)).clamp(0.2, 5.0) * step;
    if step < h { h.max(grown) } else { grown }
}

/// What to try after a `step` with this `error` was rejected; `lost` is the share to take where there is no error to go by.
pub(super) fn rejected(step: f64, error: f64, exponent: f64, lost: f64) -> f64 {
    step * if error.is_finite() { (SAFETY * error.powf(exponent)).clamp(0.1, 0.8) } else { lost }
}

/// How many equal steps of `length` span takes, none longer.
pub(super) fn count(span: f64, length: f64) -> usize {
    (span / length * (1.0 - 1e-9)).ceil().max(1.0) as usize
}
