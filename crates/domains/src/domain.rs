//! Force elements of a mechanism: one trait for fields, contacts, loads and the motion of a frame.
//!
//! The mechanism knows bodies and joints; a domain knows where those are and what drives it, and says what that does to them.
//! Its potential Π(q, u) gives all of it, so that forces, stiffness, charges and the small-signal response agree:
//! ```text
//! forces ∂Π/∂q      tangent ∂²Π/∂q²      change of the forces with what drives it ∂²Π/∂q∂u      charge −∂Π/∂u
//! ```
//! Constant damping belongs to the mechanism: a domain returns its dampers when it is built
//! ([`super::from_structure::FromStructure::dampers`]), and every integrator, frequency response and noise has them.
//! Other forces that depend on rates are added by [`Domain::add_loss`]. Other states of a domain are
//! coordinates of bodies without mass, which its forces act on ([`super::plate_film`]). Heat has states apart ([`super::lag`]):
//! temperatures follow voltages alone, so that they come before the mechanism and not with it.
//!
//! Nothing here is called through a pointer: [`super::member::Member`] is one of the registered domains, chosen by a `match`.

use super::approach::{Approach, MaterialPoint};
use super::contact_loss::Loss;
use super::loss_tangent::LossTangent;
use super::point_law::{Law, PointLaw};
use super::squeeze_film::SqueezeFilm;
use super::stick_point::StickPoint;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Pattern};
use nalgebra::{Vector2, Vector6};

/// Where the bodies are.
#[derive(Debug, Clone, Copy)]
pub struct Configuration<'a> {
    /// Displacements.
    pub q: &'a [Pose],
    /// Small displacements about the drawing.
    pub linear: bool,
}

/// A step of length `h` (s): its start, middle and end.
#[derive(Debug, Clone, Copy)]
pub struct Chord<'a> {
    /// Configurations at the start, the middle and the end.
    pub at: [Configuration<'a>; 3],
    /// Length (s).
    pub h: f64,
}

/// Half of the change of the force on a state with displacements of two bodies, while the force on the bodies does not change with the state: the skew part
/// of a derivative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkewCoupling {
    /// Body and direction of the state.
    pub state: (usize, usize),
    /// The two bodies.
    pub bodies: [BodyId; 2],
    /// Of their coordinates (N/m, N/m, N each).
    pub half: Vector6<f64>,
}

/// How far the fingers of a comb lie aside of the middle of their gaps, and how far they can (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SideRoom {
    /// As drawn.
    pub drawn: f64,
    /// Until their sides touch.
    pub room: f64,
}

/// Sides of fingers that face each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SideContact {
    /// Distance left (m).
    pub left: f64,
    /// Distance at which they touch (m).
    pub touch: f64,
    /// Least distance that the law of contact knows (m).
    pub least: f64,
}

/// One thing that acts on bodies. Forces are those of the residual: minus the wrench on each body.
pub trait Domain {
    /// Its input: the voltage across a gap (V), the fraction of the dead loads that acts (1), a force (N), the motion
    /// of a frame.
    type Given: Copy;

    /// Calls `see` for each body that forces act on.
    fn bodies(&self, see: impl FnMut(BodyId));

    /// `see` is called with each pair of bodies that the tangent couples; some come more than once.
    fn pairs(&self, mut see: impl FnMut(BodyId, BodyId)) {
        let mut bodies = Vec::new();
        self.bodies(|body| bodies.push(body));
        for (i, a) in bodies.iter().enumerate() {
            bodies[..i].iter().for_each(|b| see(*a, *b));
        }
    }

    /// `r += ∂Π/∂q`, held directions not removed; nothing without a potential.
    fn add_force(&self, at: Configuration<'_>, given: Self::Given, r: &mut [Pose]) {
        let _ = (at, given, r);
    }

    /// `r += (∂²Π/∂q∂u)·change`: how the forces at `given` change with it.
    fn add_force_change(&self, at: Configuration<'_>, given: Self::Given, change: Self::Given, r: &mut [Pose]) {
        let _ = (at, given, change, r);
    }

    /// `tangent += ∂²Π/∂q²`, on a pattern that couples its bodies.
    fn add_tangent(&self, at: Configuration<'_>, given: Self::Given, pattern: &Pattern, tangent: &mut BodyMatrix) {
        let _ = (at, given, pattern, tangent);
    }

    /// Both: [`Domain::add_force`] and [`Domain::add_tangent`].
    fn add_force_and_tangent(
        &self,
        at: Configuration<'_>,
        given: Self::Given,
        pattern: &Pattern,
        (r, tangent): (&mut [Pose], &mut BodyMatrix),
    ) {
        self.add_force(at, given, r);
        self.add_tangent(at, given, pattern, tangent);
    }

    /// [`Domain::add_force`]. True where the evaluation shows that nothing touches; false: nothing is known.
    fn add_force_finding_apart(&self, at: Configuration<'_>, given: Self::Given, r: &mut [Pose]) -> bool {
        self.add_force(at, given, r);
        false
    }

    /// [`Domain::add_force_and_tangent`] with the same result.
    fn add_force_and_tangent_finding_apart(
        &self,
        at: Configuration<'_>,
        given: Self::Given,
        pattern: &Pattern,
        sums: (&mut [Pose], &mut BodyMatrix),
    ) -> bool {
        self.add_force_and_tangent(at, given, pattern, sums);
        false
    }

    /// True where it has two sides with a distance between them, and is called a gap.
    fn is_gap(&self) -> bool {
        !self.is_gas()
    }

    /// False where it adds no force of a potential, wherever the bodies are.
    fn is_active(&self, given: Self::Given) -> bool {
        let _ = given;
        !self.is_gas()
    }

    /// False where it adds no force of a potential to the bodies as drawn.
    fn is_active_as_drawn(&self, given: Self::Given) -> bool {
        self.is_active(given)
    }

    /// Calls `lever` for each point with a force of fixed direction, and the force (N): terms that the tangent of a
    /// linear model omits.
    fn load_points(&self, at: Configuration<'_>, given: Self::Given, lever: impl FnMut(MaterialPoint, Vector2<f64>)) {
        let _ = (at, given, lever);
    }

    /// Π (J) without the terms of the field, −½·C·V², and of contact, which have functions of their own below.
    fn energy(&self, at: Configuration<'_>, given: Self::Given) -> f64 {
        let _ = (at, given);
        0.0
    }

    /// Capacitance (F).
    fn capacitance(&self, at: Configuration<'_>) -> f64 {
        let _ = at;
        0.0
    }

    /// Change of the capacitance with a change `dq` of the configuration (F).
    fn capacitance_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let _ = (at, dq);
        0.0
    }

    /// Force per ½V² that pulls its two sides together, ∂C/∂u with u the approach of all of it (N/V²).
    fn pull(&self, at: Configuration<'_>) -> f64 {
        let _ = at;
        0.0
    }

    /// The same, and its change with a change `dq` of the configuration.
    fn pull_and_change(&self, at: Configuration<'_>, dq: &[Pose]) -> (f64, f64) {
        let _ = (at, dq);
        (0.0, 0.0)
    }

    /// True for electrodes that voltage draws upon each other.
    fn is_electrostatic(&self) -> bool {
        false
    }

    /// `r +=` the change of the forces by the shape that beams take within segments under the load along them, which forces on the
    /// bodies leave out; the sum of the changes' sizes (N).
    fn add_shape_force(&self, at: Configuration<'_>, given: Self::Given, r: &mut [Pose]) -> f64 {
        let _ = (at, given, r);
        0.0
    }

    /// Distance left between its two sides (m); infinite where it has none.
    fn distance(&self, at: Configuration<'_>) -> f64 {
        let _ = at;
        f64::INFINITY
    }

    /// Change of the distance with a change `dq` of the configuration (m).
    fn distance_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let _ = (at, dq);
        0.0
    }

    /// Distance at which its sides touch, and the least one that its law of contact knows (m); none: they never do.
    fn touching(&self) -> Option<[f64; 2]> {
        None
    }

    /// Bound of the way by which displacements `q` from the drawing bring its two sides together (m), a norm of `q`; infinite where none is known.
    fn closing_bound(&self, q: &[Pose]) -> f64 {
        let _ = q;
        f64::INFINITY
    }

    /// True where a bound leaves its sides apart: cheap, and exact enough for most states of an open gap. False says nothing.
    fn surely_apart(&self, at: Configuration<'_>) -> bool {
        let _ = at;
        false
    }

    /// Remaining travel until the gap is closed completely (m).
    fn clearance(&self, at: Configuration<'_>) -> f64 {
        self.distance(at)
    }

    /// The motion of fingers across their gaps, where they have a side force.
    fn side_room(&self) -> Option<(&Approach, SideRoom)> {
        None
    }

    /// The sides of fingers that overlap; none: no finger faces another with its side.
    fn side_contact(&self, at: Configuration<'_>) -> Option<SideContact> {
        let _ = at;
        None
    }

    /// Change of the distance left between those sides with a change `dq` of the configuration (m).
    fn side_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let _ = (at, dq);
        0.0
    }

    /// Force with which its sides bear on each other (N).
    fn bearing(&self, at: Configuration<'_>) -> f64 {
        let _ = at;
        0.0
    }

    /// Change of that force with a change `dq` of the configuration (N).
    fn bearing_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let _ = (at, dq);
        0.0
    }

    /// Energy stored where its sides touch (J).
    fn contact_energy(&self, at: Configuration<'_>) -> f64 {
        let _ = at;
        0.0
    }

    /// Work of the contact force over a small change `dq` of the configuration (J), of either sign.
    fn contact_work(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let _ = (at, dq);
        0.0
    }

    /// Contact losses; `None` without contact.
    fn loss(&self) -> Option<Loss> {
        None
    }

    /// Replaces it.
    fn set_loss(&mut self, loss: Loss) {
        let _ = loss;
    }

    /// `r +=` a load that closes its contact as drawn, of any size. Returns how far its parts fall, as [`super::contact_speed`] takes it (m).
    fn add_closing(&self, at: Configuration<'_>, r: &mut [Pose]) -> f64 {
        let _ = (at, r);
        0.0
    }

    /// True where forces that depend on rates take energy out of a motion: loss of contact, gas.
    fn damps(&self) -> bool {
        self.is_gas() || self.loss().is_some_and(|loss| loss.is_dissipative())
    }

    /// True where friction holds it at rest, too.
    fn sticks(&self) -> bool {
        false
    }

    /// The part that friction holds at rest.
    fn stick_point(&self, at: Configuration<'_>) -> Option<StickPoint> {
        let _ = at;
        None
    }

    /// True where friction acts across its approach.
    fn slides(&self) -> bool {
        false
    }

    /// True of a film of gas, which acts on motions alone.
    fn is_gas(&self) -> bool {
        false
    }

    /// Mean pressure of the gas in it over the ambient one (1), `rate` the rate of each body.
    fn film_pressure(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose) -> f64 {
        let _ = (at, rate);
        0.0
    }

    /// Power that gas in gaps takes from a motion `dq` per second at the angular frequency `omega` (rad/s), per ω²: Re dqᵀZ(ω)dq (N·s/m times m²).
    fn gas_damping(&self, at: Configuration<'_>, dq: &[Pose], omega: f64) -> f64 {
        let _ = (at, dq, omega);
        0.0
    }

    /// The approach and the damping of a film of gas that is a function of one approach; the distance as drawn (m).
    fn film(&self) -> Option<(&Approach, f64, SqueezeFilm)> {
        None
    }

    /// `r +=` the force that rates add to ∂Π/∂q, `rate` the rate of each body.
    fn add_loss(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, r: &mut [Pose]) {
        let _ = (at, rate, r);
    }

    /// Adds the derivatives of that force with displacements and with rates. True where there are any.
    fn add_loss_tangent(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, to: &mut LossTangent<'_>) -> bool {
        let _ = (at, rate, to);
        false
    }

    /// Calls `see` with the skew part of those derivatives, of which the matrices have the symmetric one.
    fn skew_couplings(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, see: impl FnMut(SkewCoupling)) {
        let _ = (at, rate, see);
    }

    /// Adds its discrete force over a step, loss included, and the symmetric part of the tangent with the end of the step.
    fn add_quotient(
        &self,
        chord: &Chord<'_>,
        given: Self::Given,
        pattern: &Pattern,
        r: &mut [Pose],
        tangent: &mut BodyMatrix,
    ) {
        self.add_force(chord.at[1], given, r);
        self.add_tangent(chord.at[1], given, pattern, tangent);
    }

    /// The approach and the law, where it is a function of one approach.
    fn law(&self) -> Option<(&Approach, Law)> {
        None
    }

    /// Approaches and laws, where it is a sum of functions of one approach each; empty: it is none.
    fn laws(&self) -> Vec<(Approach, Law)> {
        self.law().map(|(approach, law)| (*approach, law)).into_iter().collect()
    }

    /// The laws of its points, where its potential and its drag are sums of functions of one approach each; empty: they are not.
    fn point_laws(&self) -> Vec<PointLaw> {
        let loss = self.loss().map_or(0.0, |loss| loss.coefficient());
        let own = self.laws().into_iter().map(|(_, law)| PointLaw { law: Some(law), loss, film: None });
        let film = self.film().map(|(_, drawn, film)| PointLaw { law: None, loss: 0.0, film: Some((drawn, film)) });
        own.chain(film).collect()
    }

    /// Calls `put` with the approach of each of these points (m).
    fn point_approaches(&self, at: Configuration<'_>, mut put: impl FnMut(f64)) {
        self.laws().iter().for_each(|(approach, _)| put(approach.value(at.q, at.linear)));
        if let Some((approach, ..)) = self.film() {
            put(approach.value(at.q, at.linear));
        }
    }
}
