//! Coordinates that follow their forces at once in a file.
//!
//! A coordinate of 32 times the slowest frequency or more needs no inertia: a simulator would follow oscillations that ports do not see. Its
//! equilibrium then has to exist wherever the others are. Where fingers of a comb close across their gaps, the force of the impact outweighs its
//! stiffness by the curvature of the motion: it runs away by itself, which no step in time can follow. All coordinates then keep their inertia.
//! Gaps along beams close point by point; files of them pass impacts without.

use super::PolynomialModel;

/// Mass over that of the slowest coordinate below which a coordinate is 32 times as fast or more (1).
pub const FAST: f64 = 1e-3;

/// Whether each coordinate follows its forces at once: the fast ones, unless fingers of a comb touch across their gaps at one of these states.
pub(super) fn following(model: &PolynomialModel, states: &[Vec<f64>]) -> Vec<bool> {
    let slowest = model.mass.iter().copied().fold(0.0, f64::max);
    let closes = states.iter().any(|x| closes(model, x));
    model.mass.iter().map(|mass| !closes && *mass < FAST * slowest).collect()
}

/// Whether fingers of a comb touch across their gaps.
fn closes(model: &PolynomialModel, x: &[f64]) -> bool {
    let approach = model.approaches(&model.monomials.values(x));
    model.approaches.members.iter().any(|points| {
        points.laws.iter().enumerate().any(|(k, law)| {
            let at = points.first + k;
            law.comb().is_some_and(|comb| comb.pressed([approach[at], approach[at + 1]]).is_some())
        })
    })
}
