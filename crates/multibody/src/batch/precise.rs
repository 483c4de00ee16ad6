//! The product of a tangent with a displacement in extended precision: [`crate::precise`] over lanes.

use super::double::LaneDouble;
use super::{LANES, Lane8, LanePose, SimdReal, load};
use crate::Model;
use crate::forces::{RestStrain, factored};
use crate::planar::Pose;
use crate::scalar::StoredReal;
use crate::section::{NONE, PairSlot};

/// Numbers of a pair's tangent: the slopes u, g, of both turns, the stiffness, and the rest.
const NUMBERS: usize = 21;

/// A force on each body as a sum of two numbers.
pub type PrecisePose<T = Lane8> = [[T; 2]; 3];

/// ∂²U/∂q² of the joints of each variant, unsummed.
#[derive(Debug, Clone, Default)]
pub struct LanePrecise {
    joints: Vec<(PairSlot, [Lane8; NUMBERS])>,
}

impl LanePrecise {
    /// Puts the tangent of a model at `q` into one lane. All lanes must have the same joints, and none of them couplings.
    #[inline]
    pub fn set_lane(&mut self, lane: usize, model: &Model, q: &[Pose], rest: &RestStrain<'_>) {
        let joints = factored(model, q, rest);
        if self.joints.len() != joints.len() {
            self.joints = joints.iter().map(|(place, _)| (*place, [Lane8::NONE; NUMBERS])).collect();
        }
        debug_assert!(lane < LANES && model.couplings.is_empty());
        for ((_, to), (_, tangent)) in self.joints.iter_mut().zip(&joints) {
            for (to, from) in to.iter_mut().zip(tangent.numbers()) {
                to.set_lane(lane, from);
            }
        }
    }

    /// `y += K·x`.
    #[inline(always)]
    pub fn multiply_add<W: SimdReal>(&self, simd: W::Simd, x: &[LanePose], y: &mut [PrecisePose]) {
        let none = W::splat(simd, 0.0);
        for (place, numbers) in &self.joints {
            let at = |body: u32| if body == NONE { [none; 3] } else { load(simd, &x[body as usize]) };
            let force = times::<W>(&load(simd, numbers), &at(place.a), &at(place.b));
            for (body, force) in [(place.a, force.0), (place.b, force.1)] {
                if body != NONE {
                    for (to, force) in y[body as usize].iter_mut().zip(force) {
                        let [high, low] = load::<W, 2>(simd, to);
                        let sum = LaneDouble { high, low }.plus(force);
                        sum.high.store(&mut to[0]);
                        sum.low.store(&mut to[1]);
                    }
                }
            }
        }
    }
}

type Three<W> = [LaneDouble<W>; 3];

/// The product of a pair's tangent with the poses of its bodies: forces on both.
#[inline(always)]
fn times<W: SimdReal>(t: &[W; NUMBERS], qa: &[W; 3], qb: &[W; 3]) -> (Three<W>, Three<W>) {
    let of = LaneDouble::of;
    let (dx, dy) = (of(qb[0]).minus(of(qa[0])), of(qb[1]).minus(of(qa[1])));
    let (a, b) = (of(qa[2]), of(qb[2]));
    let axial = dx.times(t[0]).plus(dy.times(t[1])).plus(a.times(t[4])).plus(b.times(t[7]));
    let across = dx.times(t[2]).plus(dy.times(t[3])).plus(a.times(t[5])).plus(b.times(t[8]));
    let bent = a.times(t[6]).plus(b.times(t[9]));
    let (uu, ug, up, gg, gp, pp) = (t[10], t[11], t[12], t[13], t[14], t[15]);
    let u = axial.times(uu).plus(across.times(ug)).plus(bent.times(up));
    let g = axial.times(ug).plus(across.times(gg)).plus(bent.times(gp));
    let p = axial.times(up).plus(across.times(gp)).plus(bent.times(pp));
    let both = a.plus(b);
    let aside = dx.times(t[16]).plus(dy.times(t[17]));
    let x = u.times(t[0]).plus(g.times(t[2])).plus(both.times(t[16]));
    let y = u.times(t[1]).plus(g.times(t[3])).plus(both.times(t[17]));
    let moment_a = u.times(t[4]).plus(g.times(t[5])).plus(p.times(t[6])).plus(aside);
    let moment_a = moment_a.plus(a.times(t[18])).plus(b.times(t[19]));
    let moment_b = u.times(t[7]).plus(g.times(t[8])).plus(p.times(t[9])).plus(aside);
    let moment_b = moment_b.plus(a.times(t[19])).plus(b.times(t[20]));
    let less = |x: LaneDouble<W>| LaneDouble { high: -x.high, low: -x.low };
    ([less(x), less(y), moment_a], [x, y, moment_b])
}
