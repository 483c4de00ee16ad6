//! Coordinates that follow their forces at once in a file.
//!
//! A coordinate of 32 times the slowest frequency or more needs no inertia: a simulator would follow oscillations that ports do not see. Its
//! equilibrium then has to exist wherever the others are. It does not where parts touch: contact of one point pushes others apart, and the force of an
//! impact on fingers of a comb outweighs the stiffness by the curvature of the motion. A coordinate without inertia then jumps, which no step in time can
//! follow. There only those of 100 times the slowest frequency or more have none. Critical damping in place of that takes fewer points, but a switch closes
//! 5 % later: a coordinate of 590 times the slowest frequency has the stretch of its beams.

use super::PolynomialModel;
use bimorph_domains::{Law, PointLaw};

/// Mass over that of the slowest coordinate below which a coordinate is 32 times as fast or more (1).
pub const FAST: f64 = 1e-3;
/// The same of 100 times (1).
const FASTEST: f64 = 1e-4;

/// Whether each coordinate follows its forces at once: the fast ones, or where parts touch at one of these states the fastest.
pub(super) fn following(model: &PolynomialModel, states: &[Vec<f64>]) -> Vec<bool> {
    let slowest = model.mass.iter().copied().fold(0.0, f64::max);
    let share = if states.iter().any(|x| touches(model, x)) { FASTEST } else { FAST };
    model.mass.iter().map(|mass| *mass < share * slowest).collect()
}

/// Whether parts touch.
fn touches(model: &PolynomialModel, x: &[f64]) -> bool {
    let approach = model.approaches(&model.monomials.values(x));
    let presses = |law: &PointLaw, at: usize| match law.law {
        Some(Law::Comb(comb)) => comb.pressed([approach[at], approach[at + 1]]).is_some(),
        Some(Law::Field(_, Some(_))) => law.at(approach[at], 0.0).force > 0.0,
        _ => false,
    };
    let members = &model.approaches.members;
    members.iter().any(|points| points.laws.iter().enumerate().any(|(k, law)| presses(law, points.first + k)))
}
