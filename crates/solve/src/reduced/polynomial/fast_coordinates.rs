//! Coordinates that follow their forces at once in a file.
//!
//! A coordinate of 32 times the slowest frequency or more needs no inertia: a simulator would follow oscillations that ports do not see. Its
//! equilibrium then has to exist wherever the others are. It does not where parts touch: contact of one point pushes others apart, and a coordinate without
//! inertia jumps, which no step in time can follow. There only those of 100 times the slowest frequency or more have none. Where fingers of a comb close
//! across their gaps, the force of the impact outweighs the stiffness of any by the curvature of the motion, and all keep their inertia. Critical damping in
//! place of inertia takes fewer points, but a switch closes 5 % later: a coordinate of 590 times the slowest frequency has the stretch of its beams.

use super::PolynomialModel;
use bimorph_domains::{Law, PointLaw};

/// Mass over that of the slowest coordinate below which a coordinate is 32 times as fast or more (1).
pub const FAST: f64 = 1e-3;
/// The same of 100 times (1).
const FASTEST: f64 = 1e-4;

/// Whether each coordinate follows its forces at once: the fast ones, or where parts touch at one of these states the fastest or none.
pub(super) fn following(model: &PolynomialModel, states: &[Vec<f64>]) -> Vec<bool> {
    let slowest = model.mass.iter().copied().fold(0.0, f64::max);
    let share = states.iter().map(|x| follows_at(model, x)).fold(FAST, f64::min);
    model.mass.iter().map(|mass| *mass < share * slowest).collect()
}

/// Mass over that of the slowest coordinate below which a coordinate may follow its forces at a state (1).
fn follows_at(model: &PolynomialModel, x: &[f64]) -> f64 {
    let approach = model.approaches(&model.monomials.values(x));
    let of_law = |law: &PointLaw, at: usize| match law.law {
        Some(Law::Comb(comb)) if comb.pressed([approach[at], approach[at + 1]]).is_some() => 0.0,
        Some(Law::Field(_, Some(_))) if law.at(approach[at], 0.0).force > 0.0 => FASTEST,
        _ => FAST,
    };
    let members = model.approaches.members.iter();
    members.flat_map(|points| (points.first..).zip(&points.laws)).map(|(at, law)| of_law(law, at)).fold(FAST, f64::min)
}
