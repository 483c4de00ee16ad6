//! Where the bodies are: poses, rates and accelerations from the coordinates, root to leaf.
//!
//! With m the parent, c the body, σ the sign of the joint, d = u·e₁(ψ) + g·e₂(ψ) the opening at the joint, ψ = β + (θ_m + θ_c)/2,
//! u = e_u − [g p]Q[g p]ᵀ, r the turned arms, and t(·) a right angle's turn:
//! ```text
//! x_c = x_m + (R_m − 1)·arm_m − (R_c − 1)·arm_c + σ·d                 θ_c = θ_m + σ·p
//! ẋ_c = ẋ_m + θ̇_m·t(L) + S_u·ė_u + S_g·ġ + S_p·ṗ                      L = r_m − r_c + σ·d, from centre to centre
//! S_u = σ·e₁       S_g = σ·(e₂ − 2·b_g·e₁)       S_p = −σ·t(r_c) + ½·t(d) − 2σ·b_p·e₁       b = Q·(g, p)
//! ẍ_c = ẍ_m + θ̈_m·t(L) + S·(ë_u, g̈, p̈) + bias
//! bias = −θ̇_m²·r_m + θ̇_c²·r_c + σ·(2ψ̇·(u̇·e₂ − ġ·e₁) − ψ̇²·d − 2·[ġ ṗ]Q[ġ ṗ]ᵀ·e₁)
//! ```
//! The bias is the second derivative of the map from (θ_m, e_u, g, p) to x_c, twice along the rates: [`super::geometric`]
//! takes its coefficients for the stiffness that a force brings.

use super::number::Number;
use super::tree::{Link, Parent, Tree};
use crate::multibody::planar::Pose;

/// A pair of numbers.
pub(super) type Pair<T> = [T; 2];
/// Three numbers: of the plane, or of a joint.
pub(super) type Triple<T> = [T; 3];

#[inline(always)]
fn turn<T: Number>(v: Pair<T>) -> Pair<T> {
    [-v[1], v[0]]
}

#[inline(always)]
pub(super) fn dot<T: Number>(a: Pair<T>, b: Pair<T>) -> T {
    a[0] * b[0] + a[1] * b[1]
}

/// How a body moves with its parent's rotation and with its own coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Map<T> {
    /// t(L): motion with the parent's rotation [m/rad].
    pub(super) lever: Pair<T>,
    /// S_u, S_g, S_p.
    pub(super) columns: [Pair<T>; 3],
}

impl<T: Number> Map<T> {
    pub(super) const REST: Self = Self { lever: [T::ZERO; 2], columns: [[T::ZERO; 2]; 3] };

    /// The body's motion from the parent's and from the coordinates' motion `s`.
    #[inline(always)]
    pub(super) fn apply(&self, sign: f64, parent: &Triple<T>, s: &Triple<T>) -> Triple<T> {
        let [u, g, p] = &self.columns;
        let along = |i: usize| parent[i] + parent[2] * self.lever[i] + (u[i] * s[0] + g[i] * s[1] + p[i] * s[2]);
        [along(0), along(1), parent[2] + s[2] * sign]
    }

    /// Share of a wrench on the body in the coordinates.
    #[inline(always)]
    pub(super) fn gather(&self, sign: f64, wrench: &Triple<T>) -> Triple<T> {
        let f = [wrench[0], wrench[1]];
        let [u, g, p] = self.columns;
        [dot(u, f), dot(g, f), dot(p, f) + wrench[2] * sign]
    }

    /// The wrench as the parent feels it.
    #[inline(always)]
    pub(super) fn pass(&self, wrench: &Triple<T>) -> Triple<T> {
        [wrench[0], wrench[1], wrench[2] + dot(self.lever, [wrench[0], wrench[1]])]
    }
}

/// Sine and cosine of half a rotation, and what follows.
#[derive(Debug, Clone, Copy)]
struct Half<T> {
    sin: T,
    cos: T,
}

impl<T: Number> Half<T> {
    #[inline(always)]
    fn new(theta: T) -> Self {
        let (sin, cos) = (theta * 0.5).sin_cos();
        Self { sin, cos }
    }

    /// (R − 1)·v without cancellation.
    #[inline(always)]
    fn swing(&self, v: Pair<f64>) -> Pair<T> {
        let (less, whole) = (self.sin * self.sin * -2.0, self.sin * self.cos * 2.0);
        [less * v[0] - whole * v[1], whole * v[0] + less * v[1]]
    }
}

/// A body on the way.
#[derive(Debug, Clone, Copy)]
struct Place<T> {
    half: Half<T>,
    at: Triple<T>,
    rate: Triple<T>,
    acceleration: Triple<T>,
}

impl<T: Number> Place<T> {
    fn ground() -> Self {
        let none = [T::ZERO; 3];
        let half = Half { sin: T::ZERO, cos: T::constant(1.0) };
        Self { half, at: none, rate: none, acceleration: none }
    }
}

/// Where the bodies are, with the maps that their motion goes through. One entry for each body.
#[derive(Debug, Clone)]
pub struct Placed<T> {
    places: Vec<Place<T>>,
    /// Maps of the configuration.
    pub(crate) maps: Vec<Map<T>>,
    /// Sums of wrenches on the way to the root.
    pub(super) sums: Vec<Triple<T>>,
}

/// What of a motion is to be placed.
pub(super) struct Coordinates<F, G, H> {
    /// Coordinates of body j.
    pub(super) at: F,
    /// Their rates.
    pub(super) rate: G,
    /// Their accelerations.
    pub(super) acceleration: H,
}

#[inline(always)]
pub(super) fn triple(x: &Pose) -> Triple<f64> {
    [x.x, x.y, x.z]
}

impl<T: Number> Placed<T> {
    /// Storage for a tree.
    pub fn new(tree: &Tree) -> Self {
        let count = tree.links.len();
        Self { places: vec![Place::ground(); count], maps: vec![Map::REST; count], sums: Vec::with_capacity(count) }
    }

    /// Places every body. `MOVING`: with rates and accelerations.
    #[inline(always)]
    pub(super) fn place<const MOVING: bool>(
        &mut self,
        tree: &Tree,
        given: &Coordinates<impl Fn(usize) -> Triple<T>, impl Fn(usize) -> Triple<T>, impl Fn(usize) -> Triple<T>>,
    ) {
        let ground = Place::ground();
        for (j, link) in tree.links.iter().enumerate().rev() {
            let parent = match link.parent {
                Parent::Body(p) => &self.places[p as usize],
                Parent::Ground => &ground,
                Parent::Free => {
                    let at = (given.at)(j);
                    let place = &mut self.places[j];
                    (place.half, place.at) = (Half::new(at[2]), at);
                    if MOVING {
                        (place.rate, place.acceleration) = ((given.rate)(j), (given.acceleration)(j));
                    }
                    let one = T::constant(1.0);
                    self.maps[j].columns = [[one, T::ZERO], [T::ZERO, one], [T::ZERO; 2]];
                    continue;
                }
            };
            let (place, map) = hung::<T, MOVING>(link, parent, j, given);
            self.places[j] = place;
            self.maps[j] = map;
        }
    }

    /// Pose of body `j`.
    #[inline(always)]
    pub(super) fn at(&self, j: usize) -> &Triple<T> {
        &self.places[j].at
    }

    /// Rate of body `j`.
    #[inline(always)]
    pub(super) fn rate(&self, j: usize) -> &Triple<T> {
        &self.places[j].rate
    }

    /// Acceleration of body `j`.
    #[inline(always)]
    pub(super) fn acceleration(&self, j: usize) -> &Triple<T> {
        &self.places[j].acceleration
    }
}

#[inline(always)]
fn hung<T: Number, const MOVING: bool>(
    link: &Link,
    parent: &Place<T>,
    j: usize,
    given: &Coordinates<impl Fn(usize) -> Triple<T>, impl Fn(usize) -> Triple<T>, impl Fn(usize) -> Triple<T>>,
) -> (Place<T>, Map<T>) {
    let s = link.sign;
    let [stretch, g, p] = (given.at)(j);
    let theta = parent.at[2] + p * s;
    let half = Half::new(theta);
    let (swing_parent, swing) =
        (parent.half.swing([link.arm_parent.x, link.arm_parent.y]), half.swing([link.arm.x, link.arm.y]));
    // the frame turns with the mean of both
    let cos = half.cos * parent.half.cos - half.sin * parent.half.sin;
    let sin = half.sin * parent.half.cos + half.cos * parent.half.sin;
    let e1 = [cos * link.axis.x - sin * link.axis.y, sin * link.axis.x + cos * link.axis.y];
    let e2 = turn(e1);
    let [gg, gp, pp] = link.second;
    let bent = [g * gg + p * gp, g * gp + p * pp];
    let u = stretch - (bent[0] * g + bent[1] * p);
    let d = [e1[0] * u + e2[0] * g, e1[1] * u + e2[1] * g];
    let t = turn(d);
    let r_parent = [swing_parent[0] + T::constant(link.arm_parent.x), swing_parent[1] + T::constant(link.arm_parent.y)];
    let r = [swing[0] + T::constant(link.arm.x), swing[1] + T::constant(link.arm.y)];
    let tr = turn(r);
    let each = |f: &dyn Fn(usize) -> T| [f(0), f(1)];
    let lever = turn(each(&|i| r_parent[i] - r[i] + d[i] * s));
    let columns = [
        each(&|i| e1[i] * s),
        each(&|i| (e2[i] - bent[0] * e1[i] * 2.0) * s),
        each(&|i| t[i] * 0.5 - (tr[i] + bent[1] * e1[i] * 2.0) * s),
    ];
    let map = Map { lever, columns };
    let along = |i: usize| parent.at[i] + (swing_parent[i] - swing[i] + d[i] * s);
    let mut place = Place { half, at: [along(0), along(1), theta], rate: [T::ZERO; 3], acceleration: [T::ZERO; 3] };
    if MOVING {
        let (v, z) = ((given.rate)(j), (given.acceleration)(j));
        place.rate = map.apply(s, &parent.rate, &v);
        let (spin_parent, spin) = (parent.rate[2], place.rate[2]);
        let frame = (spin_parent + spin) * 0.5;
        let rate_u = v[0] - (bent[0] * v[1] + bent[1] * v[2]) * 2.0;
        let curl = (v[1] * v[1] * gg + v[1] * v[2] * (2.0 * gp) + v[2] * v[2] * pp) * 2.0;
        let (mixed_2, mixed_1) = (frame * rate_u * 2.0, frame * v[1] * 2.0 + curl);
        let (squared_parent, squared, squared_frame) = (spin_parent * spin_parent, spin * spin, frame * frame);
        place.acceleration = map.apply(s, &parent.acceleration, &z);
        for i in 0..2 {
            let joint = (mixed_2 * e2[i] - mixed_1 * e1[i] - squared_frame * d[i]) * s;
            place.acceleration[i] += squared * r[i] - squared_parent * r_parent[i] + joint;
        }
    }
    (place, map)
}
