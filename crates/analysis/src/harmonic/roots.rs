//! Poles and zeros of the response.
//!
//! First guesses come from the sum over modes, as eigenvalues of a small matrix: poles of its state equations, and
//! zeros of the pencil for a motion without output in a row (Rosenbrock). Then each is found on the whole model to
//! rounding: a pole by Rayleigh quotient iteration ([`bimorph_solve::frequency::pole`]), a zero by the secant rule on
//! the exact response.
//!
//! Reference: A. Emami-Naeini, P. Van Dooren, "Computation of zeros of linear multivariable systems", Automatica 18 (1982).

use super::exact::ExactResponse;
use super::modal::ModalSum;
use super::root::Root;
use crate::readout::small_signal::FrequencyDependence;
use bimorph_solve::frequency::pole::pole;
use faer::Mat;
use nalgebra::{Complex, DMatrix};
use std::f64::consts::TAU;

/// Steps of the secant rule at most, where they begin beside the guess, and a step that is rounding, as fractions of |s|.
const MAX_STEPS: usize = 40;
const SECANT_OFFSET: f64 = 1e-4;
const SETTLED: f64 = 1e-13;
const ROUNDED: f64 = 1e-7;
/// A zero further from its guess than this fraction is another one.
const NEAR: f64 = 0.1;
/// A zero within this fraction of the damping of a pole takes it out of the curve.
const UNSEEN: f64 = 0.05;
/// Frequencies of a band at which a signal is looked for.
const SEARCH_FREQUENCIES: usize = 8;
/// Shifts about which the pencil is inverted, in units of the end of the band.
const SHIFTS: [f64; 3] = [0.37, 0.73, -0.53];
/// Two of them that are nearer to each other than this fraction are one.
const ROOT_TOLERANCE: f64 = 1e-6;

fn sorted(mut roots: Vec<Root>) -> Vec<Root> {
    roots.sort_by(|a, b| a.frequency_hz().total_cmp(&b.frequency_hz()).then(a.re.total_cmp(&b.re)));
    roots
}

/// Frequencies by which modes are scaled, and one for all (rad/s).
fn scales(sum: &ModalSum, to: f64) -> (Vec<f64>, f64) {
    let all = TAU * to;
    (sum.lambda.iter().map(|l| l.abs().sqrt().max(1e-9 * all)).collect(), all)
}

/// Poles within the band, and how many of them could not be found to rounding.
pub(super) fn poles(exact: &mut ExactResponse<'_>, sum: &ModalSum, band: [f64; 2]) -> (Vec<Root>, usize) {
    let n = sum.lambda.len();
    let wide = [0.8 * band[0], 1.25 * band[1]];
    let mut rough = 0;
    let lags = sum.laws.iter().filter_map(|law| match law {
        FrequencyDependence::Lagged(tau) => Some(Root { re: -1.0 / tau, im: 0.0 }),
        _ => None,
    });
    let mut roots: Vec<Root> = lags.collect();
    if sum.undamped() {
        roots.extend(sum.lambda.iter().map(|l| match l {
            l if *l >= 0.0 => Root { re: 0.0, im: l.sqrt() },
            l => Root { re: (-l).sqrt(), im: 0.0 },
        }));
    } else if n > 0 {
        let (omega, all) = scales(sum, band[1]);
        let state = Mat::from_fn(2 * n, 2 * n, |i, j| match (i.checked_sub(n), j.checked_sub(n)) {
            (None, Some(k)) if i == k => omega[i] / all,
            (Some(i), None) if i == j => -sum.lambda[i] / omega[i] / all,
            (Some(i), Some(k)) => -sum.damping[(i, k)] / all,
            _ => 0.0,
        });
        let guesses = state.eigenvalues();
        // without them poles of this group are missing
        rough += usize::from(guesses.is_err());
        let guesses = guesses.unwrap_or_default();
        for guess in guesses.into_iter().map(|s| Complex::new(s.re, s.im) * all).filter(|s| s.im >= 0.0) {
            if !Root::new(guess).within(wide) {
                continue;
            }
            let found =
                exact.with_system(|system, tangent, harmonic| pole(harmonic, system, tangent, guess, &sum.stir));
            rough += usize::from(found.is_none());
            roots.push(Root::new(found.unwrap_or(guess)));
        }
    }
    roots.retain(|root| root.within(band));
    (sorted(roots), rough)
}

/// Zeros of a row within the band; `sum` knows its modes to beyond it.
pub(super) fn zeros(exact: &mut ExactResponse<'_>, sum: &ModalSum, row: usize, band: [f64; 2]) -> Vec<Root> {
    let mut roots: Vec<Root> = Vec::new();
    // what the drive does not move at all has rounding for zeros
    let mut is_seen = |k: usize| {
        let share = k as f64 / (SEARCH_FREQUENCIES - 1) as f64;
        let s = Complex::new(0.0, TAU * band[0] * (band[1] / band[0]).powf(share));
        exact.at(s).is_none_or(|rows| rows[row].norm() > super::modal::UNSEEN * sum.most(s, row))
    };
    if !(0..SEARCH_FREQUENCIES).any(&mut is_seen) {
        return roots;
    }
    let wide = [0.8 * band[0], 1.25 * band[1]];
    for guess in guesses(sum, row, band[1]) {
        if guess.im < 0.0 || !Root::new(guess).within(wide) {
            continue;
        }
        let Some(root) = secant(exact, row, guess, sum.undamped()).map(Root::new).filter(|root| root.within(band))
        else {
            continue;
        };
        let same =
            |other: &Root| (other.re - root.re).hypot(other.im - root.im) <= ROOT_TOLERANCE * TAU * root.frequency_hz();
        if !roots.iter().any(same) {
            roots.push(root);
        }
    }
    sorted(roots)
}

/// The poles and damped zeros that give a curve its shape: those of a signal without a zero or pole that takes it away. `zeros` by signal;
/// a signal whose zeros are not known may see every pole.
pub(super) fn shaping(poles: &[Root], zeros: &[Option<Vec<Root>>]) -> Vec<Root> {
    let takes = |a: &Root, b: &Root| {
        let size = UNSEEN * a.re.abs() + ROOT_TOLERANCE * a.frequency_hz() * TAU;
        (a.re - b.re).hypot(a.im - b.im) <= size
    };
    let seen =
        |pole: &&Root| zeros.iter().any(|own| own.as_ref().is_none_or(|own| !own.iter().any(|zero| takes(pole, zero))));
    let mut shaping: Vec<Root> = poles.iter().filter(seen).copied().collect();
    let own = zeros.iter().flatten().flatten();
    shaping.extend(own.filter(|zero| zero.quality().is_some() && !poles.iter().any(|pole| takes(pole, zero))));
    shaping
}

/// Eigenvalues of the pencil A − s·E over modes, their rates, lags and the drive, with the row as its last equation.
fn guesses(sum: &ModalSum, row: usize, to: f64) -> Vec<Complex<f64>> {
    let n = sum.lambda.len();
    let lags: Vec<(usize, f64)> = (sum.laws.iter().enumerate())
        .filter_map(|(c, law)| if let FrequencyDependence::Lagged(tau) = law { Some((c, *tau)) } else { None })
        .collect();
    let at_once = |c: usize| sum.laws[c] == FrequencyDependence::AtOnce;
    let size = 2 * n + lags.len() + 1;
    let u = size - 1;
    let (omega, all) = scales(sum, to);
    let (mut a, mut e) = (DMatrix::<f64>::zeros(size, size), DMatrix::<f64>::zeros(size, size));
    for j in 0..n {
        // x = ω·η, w = η's rate
        e[(j, j)] = 1.0;
        a[(j, n + j)] = omega[j] / all;
        e[(n + j, n + j)] = 1.0;
        a[(n + j, j)] = -sum.lambda[j] / omega[j] / all;
        for k in 0..n {
            a[(n + j, n + k)] -= sum.damping[(j, k)] / all;
        }
        for c in 0..sum.laws.len() {
            match sum.laws[c] {
                FrequencyDependence::AtOnce => a[(n + j, u)] += sum.push[(j, c)] / all,
                FrequencyDependence::Rate => e[(n + j, u)] -= sum.push[(j, c)],
                FrequencyDependence::Lagged(_) => {}
            }
        }
        for (l, (c, _)) in lags.iter().enumerate() {
            a[(n + j, 2 * n + l)] += sum.push[(j, *c)] / all;
        }
    }
    for (l, (_, tau)) in lags.iter().enumerate() {
        let h = 2 * n + l;
        e[(h, h)] = 1.0;
        a[(h, h)] = -1.0 / (tau * all);
        a[(h, u)] = 1.0 / (tau * all);
    }
    // a rate is s times what the row sees: its zero at 0 is left out, unless something is conducted as well
    let whole = sum.rates[row] && sum.conducted[row] != 0.0;
    for j in 0..n {
        let seen = sum.seen[(row, j)];
        if whole { a[(u, n + j)] = seen } else { a[(u, j)] = seen / omega[j] }
    }
    for c in 0..sum.laws.len() {
        let rest = sum.rest[(row, c)];
        match (whole, at_once(c)) {
            (false, true) => a[(u, u)] += rest,
            (true, true) => e[(u, u)] -= rest * all,
            (false, false) if sum.laws[c] == FrequencyDependence::Rate => e[(u, u)] -= rest * all,
            _ => {}
        }
    }
    for (l, (c, tau)) in lags.iter().enumerate() {
        let rest = sum.rest[(row, *c)];
        if whole {
            a[(u, 2 * n + l)] -= rest / tau;
            a[(u, u)] += rest / tau;
        } else {
            a[(u, 2 * n + l)] += rest;
        }
    }
    if whole {
        a[(u, u)] += sum.conducted[row];
    }
    // the drive and the row in sizes like those of the rest
    for by_row in [false, true] {
        let most = |m: &DMatrix<f64>| if by_row { m.row(u).amax() } else { m.column(u).amax() };
        let scale = most(&a).max(most(&e));
        if scale > 0.0 {
            for m in [&mut a, &mut e] {
                if by_row { m.row_mut(u).unscale_mut(scale) } else { m.column_mut(u).unscale_mut(scale) }
            }
        }
    }
    eigenvalues(&a, &e).into_iter().map(|s| s * all).collect()
}

/// Finite eigenvalues of A − s·E, with E possibly singular: s = σ + 1/μ, with μ those of (A − σE)⁻¹·E, for a σ that is
/// not an eigenvalue.
fn eigenvalues(a: &DMatrix<f64>, e: &DMatrix<f64>) -> Vec<Complex<f64>> {
    let size = a.nrows();
    for sigma in SHIFTS {
        let lu = (a - e * sigma).lu();
        let Some(t) = lu.solve(e).filter(|t| t.iter().all(|x| x.is_finite())) else { continue };
        let Ok(found) = Mat::from_fn(size, size, |i, j| t[(i, j)]).eigenvalues() else { continue };
        let finite = |mu: Complex<f64>| (mu.norm() > 1e-12).then(|| mu.inv() + sigma);
        return found.into_iter().filter_map(|mu| finite(Complex::new(mu.re, mu.im))).collect();
    }
    Vec::new()
}

/// The zero of a row of the exact response next to `guess`; on the imaginary or the real axis where nothing damps and the guess is there.
fn secant(exact: &mut ExactResponse<'_>, row: usize, guess: Complex<f64>, undamped: bool) -> Option<Complex<f64>> {
    let on = |s: Complex<f64>| match undamped {
        true if guess.re.abs() < NEAR * ROOT_TOLERANCE * guess.norm() => Complex::new(0.0, s.im),
        true if guess.im.abs() < NEAR * ROOT_TOLERANCE * guess.norm() => Complex::new(s.re, 0.0),
        _ => s,
    };
    let mut value = |s: Complex<f64>| exact.beside(s).map(|values| values[row]);
    let (mut before, mut now) = (on(guess * (1.0 + SECANT_OFFSET)), on(guess));
    let mut past = value(before)?;
    let mut last = f64::INFINITY;
    for _ in 0..MAX_STEPS {
        let here = value(now)?;
        let slope = here - past;
        if here.norm() == 0.0 {
            return Some(now);
        }
        if slope.norm() == 0.0 {
            return None;
        }
        let step = here * (now - before) / slope;
        (before, past) = (now, here);
        now = on(now - step);
        let share = step.norm() / now.norm();
        if share <= SETTLED || (share < ROUNDED && share >= 0.5 * last) {
            return ((now - guess).norm() <= NEAR * guess.norm()).then_some(now);
        }
        if share.is_nan() || (now - guess).norm() > guess.norm() {
            return None;
        }
        last = share;
    }
    None
}
