//! The squeeze film between lumped plates: a force along their approach that follows the gap and its rate.
//!
//! Without states the gas does not compress ([`super::squeeze_film`]). With states it does ([`super::film_series`]): the states are coordinates of bodies without mass, two
//! a body, so that all analyses have them, and the recursion eliminates them before the plates.
//!
//! A relative rotation of the plates has a moment of its own, of gas that does not compress.

use super::approach::{Approach, MaterialPoint};
use super::domain::{Chord, Configuration, Domain, SkewCoupling};
use super::film_series::{FilmTerm, root, series};
use super::from_structure::{FromStructure, StructureView};
use super::loss_tangent::LossTangent;
use super::quotient;
use super::squeeze_film::{SqueezeFilm, slip, tilt};
use bimorph_multibody::model::locate;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Pattern};
use bimorph_structure::GapVoltage;
use nalgebra::Matrix6;

/// States of a film that one body has.
pub const STATES_OF_BODY: usize = 2;

/// A body whose coordinates along x and y are states of a film, with their terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmBody {
    /// The body.
    pub point: MaterialPoint,
    /// Terms of its coordinates; those that it does not use have no strength.
    pub terms: [FilmTerm; STATES_OF_BODY],
}

/// Gas between two plates.
#[derive(Debug, Clone, PartialEq)]
pub struct PlateFilm {
    /// The approach of the plates.
    pub approach: Approach,
    /// Their distance as drawn (m).
    pub gap: f64,
    /// Damping without compression.
    pub film: SqueezeFilm,
    /// Moment over the rate of their relative rotation, of that damping (m²).
    pub tilt: f64,
    /// Force of the ambient pressure on the plates (N).
    pub ambient: f64,
    /// Where the gas compresses; empty: it does not.
    pub states: Vec<FilmBody>,
}

/// Damping of a state (N·s/m), and its derivatives with ζ and with the approach.
type Flow = [f64; 3];

impl PlateFilm {
    /// The force along the approach u that changes at a rate (m/s), and its derivatives with both, of gas that does not compress.
    fn drag(&self, (u, rate): (f64, f64)) -> (f64, f64, f64) {
        let (c, slope) = self.film.damping(self.gap - u);
        (c * rate, -slope * rate, c)
    }

    /// Moment over the rate of the relative rotation at the approach `u` (N·m·s).
    fn tilting(&self, u: f64) -> f64 {
        self.tilt * self.film.damping(self.gap - u).0
    }

    /// The relative rotation of bodies whose poses are `of` them.
    fn rotation(&self, of: impl Fn(usize) -> Pose) -> f64 {
        let [a, b] = self.approach.bodies().map(|id| if let BodyId::Free(k) = id { of(k).z } else { 0.0 });
        a - b
    }

    /// Adds a moment against the relative rotation.
    fn add_moment(&self, moment: f64, r: &mut [Pose]) {
        for (id, sign) in self.approach.bodies().into_iter().zip([1.0, -1.0]) {
            if let BodyId::Free(k) = id {
                r[k].z += sign * moment;
            }
        }
    }

    /// Adds its derivative with the relative rotation.
    fn add_moment_tangent(&self, slope: f64, pattern: &Pattern, tangent: &mut BodyMatrix) {
        let mut h = Matrix6::zeros();
        (h[(2, 2)], h[(5, 5)]) = (slope, slope);
        (h[(2, 5)], h[(5, 2)]) = (-slope, -slope);
        locate(pattern, self.approach.a.body, self.approach.b.body).add(tangent, &h);
    }

    /// √g at an approach, and its derivatives.
    fn root(&self, u: f64) -> [f64; 3] {
        root(self.film.thickness(self.gap - u))
    }

    /// Calls `see` for each state: its body, direction and term, and √g at its value in `q`.
    fn states(&self, q: &[Pose], mut see: impl FnMut(usize, usize, &FilmTerm, [f64; 3])) {
        for state in &self.states {
            let BodyId::Free(k) = state.point.body else { continue };
            for (i, term) in state.terms.iter().enumerate().filter(|(_, term)| term.strength > 0.0) {
                see(k, i, term, self.root(q[k][i]));
            }
        }
    }

    /// g²·Q at an approach, and its logarithmic derivative with it (1/m).
    fn flow(&self, u: f64) -> [f64; 2] {
        let [g, slope, _] = self.film.thickness(self.gap - u);
        let (q, q_slope) = slip(self.film.free_path, g);
        [g * g * q, -slope * (2.0 / g + q_slope / q)]
    }

    /// Calls `see` with the body and direction of each state and its damping.
    fn flows(&self, q: &[Pose], u: f64, mut see: impl FnMut(usize, usize, Flow)) {
        let [flow, by_u] = self.flow(u);
        self.states(q, |k, i, term, zeta| {
            let [c, by_zeta] = term.damping(flow, &zeta);
            see(k, i, [c, by_zeta, -c * by_u]);
        });
    }

    /// Adds `along` times the gradient of the approach to the row of coordinate `i` of body `k` and to its column.
    fn add_coupling(
        &self,
        gradient: &nalgebra::Vector6<f64>,
        (k, i): (usize, usize),
        along: f64,
        pattern: &Pattern,
        tangent: &mut BodyMatrix,
    ) {
        for (side, body) in self.approach.bodies().into_iter().enumerate() {
            if body == BodyId::Ground {
                continue;
            }
            let mut h = Matrix6::zeros();
            for j in 0..3 {
                let value = along * gradient[3 * side + j];
                (h[(i, 3 + j)], h[(3 + j, i)]) = (value, value);
            }
            locate(pattern, BodyId::Free(k), body).add(tangent, &h);
        }
    }
}

impl FromStructure for PlateFilm {
    fn lay<'a>(drawing: &StructureView<'a, '_>, mut put: impl FnMut(&'a str, Option<&'a GapVoltage>, Self)) {
        for (index, plate) in drawing.structure.plate_gaps.iter().enumerate() {
            let Some(gas) = &plate.gas else { continue };
            let approach = drawing.approach(plate.a, plate.b, plate.axis);
            let film = SqueezeFilm::new(gas, plate.gap, plate.touch);
            // where only nodes are known, the gas does not compress
            let bodies = drawing.film_states.get(index).map_or(&[][..], Vec::as_slice);
            let terms = if bodies.is_empty() { Vec::new() } else { series(gas, gas.states) };
            let body = |(point, terms): (&MaterialPoint, &[FilmTerm])| FilmBody {
                point: *point,
                terms: std::array::from_fn(|i| terms.get(i).copied().unwrap_or_default()),
            };
            let states = bodies.iter().zip(terms.chunks(STATES_OF_BODY)).map(body).collect();
            let [across, along] = gas.sides;
            let ambient = gas.pressure * gas.count * across * along;
            // near holes the pressure follows the local speed
            let tilt = match film.holes {
                Some(_) => across * across / 12.0,
                None => {
                    tilt(across / along) * gas.count * gas.viscosity * along * across.powi(5) / (60.0 * film.strength)
                }
            };
            put(&plate.name, None, Self { approach, gap: plate.gap, film, tilt, ambient, states });
        }
    }

    fn moved(mut self, to: &dyn Fn(MaterialPoint) -> MaterialPoint) -> Self {
        self.states.iter_mut().for_each(|state| state.point = to(state.point));
        Self { approach: self.approach.moved(to), ..self }
    }
}

impl Domain for PlateFilm {
    type Given = f64;

    fn is_gas(&self) -> bool {
        true
    }

    fn is_active(&self, _: f64) -> bool {
        !self.states.is_empty()
    }

    fn film(&self) -> Option<(&Approach, f64, SqueezeFilm)> {
        self.states.is_empty().then_some((&self.approach, self.gap, self.film))
    }

    fn film_pressure(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose) -> f64 {
        let m = self.approach.measure(at.q, at.linear);
        let mut force = 0.0;
        if self.states.is_empty() {
            force = self.drag((m.value, self.approach.rate(&m, rate))).0;
        } else {
            let u = self.root(m.value);
            self.states(at.q, |_, _, term, zeta| force += term.force(&u, &zeta)[0]);
        }
        force.abs() / self.ambient
    }

    fn gas_damping(&self, at: Configuration<'_>, dq: &[Pose], omega: f64) -> f64 {
        let m = self.approach.measure(at.q, at.linear);
        let square = self.approach.change(&m, dq).powi(2);
        let tilted = self.rotation(|k| dq[k]).powi(2) * self.tilting(m.value);
        if self.states.is_empty() {
            return square * self.drag((m.value, 0.0)).2 + tilted;
        }
        let (u, flow) = (self.root(m.value), self.flow(m.value)[0]);
        let part = |term: &FilmTerm| {
            let rate = term.rate * flow;
            term.strength * u[1] * u[1] * rate / (rate * rate + omega * omega)
        };
        let terms = self.states.iter().flat_map(|state| &state.terms).filter(|term| term.strength > 0.0);
        square * terms.map(part).sum::<f64>() + tilted
    }

    fn bodies(&self, mut see: impl FnMut(BodyId)) {
        self.approach.bodies().into_iter().for_each(&mut see);
        self.states.iter().for_each(|state| see(state.point.body));
    }

    fn pairs(&self, mut see: impl FnMut(BodyId, BodyId)) {
        let [a, b] = self.approach.bodies();
        see(a, b);
        for state in &self.states {
            see(state.point.body, a);
            see(state.point.body, b);
        }
    }

    fn add_force(&self, at: Configuration<'_>, _: f64, r: &mut [Pose]) {
        if self.states.is_empty() {
            return;
        }
        let m = self.approach.measure(at.q, at.linear);
        let (u, mut first) = (self.root(m.value), 0.0);
        self.states(at.q, |k, i, term, zeta| {
            let [along_u, along_zeta] = term.force(&u, &zeta);
            first += along_u;
            r[k][i] += along_zeta;
        });
        self.approach.add_force(&m, first, r);
    }

    fn add_tangent(&self, at: Configuration<'_>, _: f64, pattern: &Pattern, tangent: &mut BodyMatrix) {
        if self.states.is_empty() {
            return;
        }
        let m = self.approach.measure(at.q, at.linear);
        let (u, mut first, mut second) = (self.root(m.value), 0.0, 0.0);
        self.states(at.q, |k, i, term, zeta| {
            first += term.force(&u, &zeta)[0];
            let [own, across, of_state] = term.stiffness(&u, &zeta);
            second += own;
            tangent.diagonal[k][(i, i)] += of_state;
            self.add_coupling(&m.gradient, (k, i), across, pattern, tangent);
        });
        locate(pattern, self.approach.a.body, self.approach.b.body).add(tangent, &m.hessian(first, second));
    }

    fn energy(&self, at: Configuration<'_>, _: f64) -> f64 {
        let (mut sum, u) = (0.0, self.root(self.approach.value(at.q, at.linear)));
        self.states(at.q, |_, _, term, zeta| sum += term.energy(&u, &zeta));
        sum
    }

    fn add_loss(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, r: &mut [Pose]) {
        let m = self.approach.measure(at.q, at.linear);
        self.add_moment(self.tilting(m.value) * self.rotation(rate), r);
        if self.states.is_empty() {
            self.approach.add_force(&m, self.drag((m.value, self.approach.rate(&m, rate))).0, r);
        } else {
            self.flows(at.q, m.value, |k, i, [c, ..]| r[k][i] += c * rate(k)[i]);
        }
    }

    /// The flow out of a state depends on the approach, and the force along the approach not on that flow: the matrix has the symmetric part of the
    /// derivative with displacements, and [`Domain::skew_couplings`] the rest. That of the moment of tilt with the approach is left out.
    fn add_loss_tangent(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, to: &mut LossTangent<'_>) -> bool {
        let m = self.approach.measure(at.q, at.linear);
        self.add_moment_tangent(self.tilting(m.value), to.pattern, to.damping);
        if self.states.is_empty() {
            self.approach.add_rate_tangent((at.q, at.linear), rate, |now| self.drag(now), to);
            return true;
        }
        self.flows(at.q, m.value, |k, i, [c, by_zeta, by_u]| {
            let v = rate(k)[i];
            to.damping.diagonal[k][(i, i)] += c;
            to.stiffness.diagonal[k][(i, i)] += by_zeta * v;
            if v != 0.0 {
                self.add_coupling(&m.gradient, (k, i), 0.5 * by_u * v, to.pattern, to.stiffness);
            }
        });
        true
    }

    fn skew_couplings(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, mut see: impl FnMut(SkewCoupling)) {
        if self.states.is_empty() {
            return;
        }
        let m = self.approach.measure(at.q, at.linear);
        self.flows(at.q, m.value, |k, i, [.., by_u]| {
            let half = m.gradient * (0.5 * by_u * rate(k)[i]);
            see(SkewCoupling { state: (k, i), bodies: self.approach.bodies(), half });
        });
    }

    /// Its work over a step is what it stores and what is never negative: discrete gradients of the stored energy, and the flow at the middle of
    /// the step.
    fn add_quotient(&self, chord: &Chord<'_>, _: f64, pattern: &Pattern, r: &mut [Pose], tangent: &mut BodyMatrix) {
        let [start, middle, end] = chord.at;
        let [u0, u1] = [start, end].map(|at| self.approach.value(at.q, at.linear));
        let per = self.tilting(0.5 * (u0 + u1)) / chord.h;
        self.add_moment(per * self.rotation(|k| end.q[k] - start.q[k]), r);
        self.add_moment_tangent(per, pattern, tangent);
        if self.states.is_empty() {
            quotient::add_drag(&self.approach, chord, |now| self.drag(now), pattern, r, tangent);
            return;
        }
        let mut m = self.approach.measure(middle.q, middle.linear);
        m.gradient[2] *= chord.sinc(self.approach.a.body);
        m.gradient[5] *= chord.sinc(self.approach.b.body);
        m.bend = m.bend.map(|bend| 0.5 * bend);
        let (along_u, flow) = (Quotient::new(self, u0, u1), self.flow(0.5 * (u0 + u1))[0]);
        let (mut first, mut second) = (0.0, 0.0);
        self.states(start.q, |k, i, term, _| {
            let (zeta0, zeta1) = (start.q[k][i], end.q[k][i]);
            let along_zeta = Quotient::new(self, zeta0, zeta1);
            let w = along_u.mean - along_zeta.mean;
            first += term.strength * w * along_u.slope;
            second += term.strength * (0.5 * along_u.end * along_u.slope + w * along_u.slope_by_end);
            let per = term.strength / (term.rate * flow) / chord.h;
            let (moved, square) = (zeta1 - zeta0, along_zeta.slope * along_zeta.slope);
            r[k][i] += per * square * moved - term.strength * w * along_zeta.slope;
            tangent.diagonal[k][(i, i)] += per * (square + 2.0 * along_zeta.slope * along_zeta.slope_by_end * moved)
                + term.strength * (0.5 * along_zeta.end * along_zeta.slope - w * along_zeta.slope_by_end);
            let across = -0.25 * term.strength * (along_u.slope * along_zeta.end + along_zeta.slope * along_u.end);
            self.add_coupling(&m.gradient, (k, i), across, pattern, tangent);
        });
        self.approach.add_force(&m, first, r);
        locate(pattern, self.approach.a.body, self.approach.b.body).add(tangent, &m.hessian(first, second));
    }
}

/// √g over a step of a coordinate.
struct Quotient {
    /// Mean of both ends.
    mean: f64,
    /// Difference quotient, and its derivative with the end.
    slope: f64,
    slope_by_end: f64,
    /// Derivative at the end.
    end: f64,
}

impl Quotient {
    fn new(film: &PlateFilm, x0: f64, x1: f64) -> Self {
        let [a0, a1] = [film.root(x0), film.root(x1)];
        let (slope, slope_by_end) = quotient::quotient((x0, a0[0]), (x1, a1[0]), |x| {
            let [_, first, second] = film.root(x);
            (first, second)
        });
        Self { mean: 0.5 * (a0[0] + a1[0]), slope, slope_by_end, end: a1[1] }
    }
}
