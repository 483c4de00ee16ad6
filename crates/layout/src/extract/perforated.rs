//! Parts with etch holes: which of their limbs are plates, and which of their joints are bodies.
//!
//! A perforated plate longer than wide has the axis of a beam. Its limbs and the joints between them become one rigid
//! body with the mass and inertia that the holes leave. This holds where they are more than [`STIFF`] times stiffer
//! than their support and no part of them is held. Any other perforated limb stays a beam. A joint with a hole in it is
//! a node only at a free end: else it is a body, so that it lacks what the hole takes; so is one where a limb stands on
//! a perforated one.
//!
//! The edge of a perforated plate is compliant where a narrow limb meets it, like the edge of a half-plane with the
//! plate's E′. A spring represents shift and rotation, and the limb is extended into the plate by [`ROOT`] widths.

use super::anchors::{self, AnchorRule};
use super::boxes;
use super::cut::HoleCutouts;
use super::holes::{self, Hole};
use super::joints::{self, JointRole, LimbEnd, LimbGraph, LimbJoint};
use super::limbs::{self, Limb};
use super::medial::Medial;
use super::skeleton::Skeleton;
use bimorph_base::sets::Sets;
use std::f64::consts::FRAC_PI_2;

/// Ratio of the stiffness of a plate's limbs, in series, to that of each supporting limb (1).
const STIFF: f64 = 30.0;
/// Compliance of a free plate bent by its inertia, over four times that of its limbs as a cantilever (1): 5/384 over
/// 1/3.
const BENT: f64 = 0.16;
/// Limbs of one plate are given up together down to this fraction of the most compliant one (1).
const ALIKE: f64 = 0.5;

/// Extra length of a limb from the rotation of an elastic edge under a moment, in limb widths (1). With the traction of
/// a long beam on a half-plane in plane stress, the edge rotates by 16.67·M/(π·E·w²) (W. J. O'Donnell, J. Appl. Mech.
/// 27, 1960), the limb by 12·M/(E·w³) per length.
const ROOT: f64 = 0.44;
/// Contribution of the holes to that rotation, times E·w²·thickness (1): fitted, as [`FLUSH`] and [`FAR`], to plane
/// stress of the plates that `scripts/random-plates` draws.
const TURN: f64 = 0.37;
/// Relative excess of an edge's compliance at a corner (1), and its range, in widths of the limb (1).
const FLUSH: [f64; 2] = [1.1, 0.25];
/// Shift of a half-plane under an even pressure on a width w, times π·E/2 over the pressure times w: ln(D/w) and this (1), for a plate of
/// area D² (S. Timoshenko, J. N. Goodier, Theory of Elasticity, §36).
const FAR: f64 = 1.0;
/// Contribution to the shift of a plate with sides l along a limb and b across it, over E′/E (1). The first term is
/// (l/b − 1)/3, as for a bar loaded by its own inertia. The second is (b²/l² − 1) times a fitted factor, for bending.
const LONG: [f64; 2] = [1.0 / 3.0, 0.3];
/// Widest limb for which a body is a half-plane, over twice the radius of the largest disc in it (1).
const NARROW: f64 = 0.5;

/// Limbs and joints of a part with holes; `plain` are those of its outline alone.
pub(super) fn perforated(
    axis: &Medial,
    plain: &LimbGraph,
    holes: &[Hole],
    origin: [f64; 2],
    rule: &AnchorRule,
) -> LimbGraph {
    let skeleton = Skeleton::of(axis);
    let cut = HoleCutouts::of(axis, plain, holes, origin);
    let rigid = plates(axis, plain, &cut, origin, rule);
    let mut kept = rigid.iter();
    let mut limbs = limbs::limbs(&skeleton);
    limbs.retain(|_| !kept.next().is_some_and(|rigid| *rigid));
    let mut parts = joints::joints(&skeleton, limbs);
    let cut = HoleCutouts::of(axis, &parts, holes, origin);
    for j in 0..parts.joints.len() {
        let joint = &parts.joints[j];
        let point = matches!(joint.kind, JointRole::Bar { .. })
            || matches!(joint.kind, JointRole::Node(_)) && joint.ports.len() > 1;
        // where a limb stands on a perforated one, its way to the centreline would weigh twice, by different densities
        let stands = joint.ports.len() > 2 && joint.ports.iter().any(|port| cut.limbs[port.limb].moments.area > 0.0);
        if point && (stands || cut.joints[j].moments.area > 0.0) {
            let body = joints::body(&skeleton, &parts.limbs, joint);
            parts.joints[j].kind = body;
        }
        let (joint, limbs) = (&mut parts.joints[j], &parts.limbs);
        let elastic = cut.joints[j].moments.area > 0.0 && !rule.holds_body(axis, origin, limbs, joint);
        let wide = 2.0 * anchors::half_width(axis, joint);
        let stiffness = holes::stiffness(cut.joints[j].moments.area / joint.cell.area);
        let narrow = |port: &LimbEnd| elastic && limbs[port.limb].width[port.end] <= NARROW * wide;
        let elastic: Vec<bool> = joint.ports.iter().map(narrow).collect();
        let yields = |(port, narrow): (&LimbEnd, &bool)| {
            narrow.then(|| edge(axis, joint, &limbs[port.limb], port.end, stiffness))
        };
        joint.roots = joint.ports.iter().zip(&elastic).map(yields).collect();
        if let JointRole::Body(places) = &mut joint.kind {
            for ((place, port), narrow) in places.iter_mut().zip(&joint.ports).zip(elastic) {
                *place = root(*place, &limbs[port.limb], port.end, joint.cell.area, narrow);
            }
        }
    }
    parts
}

/// Compliance of the edge of a plate under a limb, times E·thickness: shift, rotation.
fn edge(axis: &Medial, joint: &LimbJoint, limb: &Limb, end: usize, stiffness: f64) -> [f64; 2] {
    let (width, d) = (limb.width[end], limb.direction());
    let room = joints::from_corner(axis, limb, end);
    let corner = 1.0 + FLUSH[0] * (-room / (FLUSH[1] * width)).exp();
    let outlines = joint.edges.iter().map(|e| &axis.edges[*e as usize]).flat_map(|e| axis.outline(e.ends, e.sites));
    let [low, high] = boxes::around(outlines.map(|p| [p[0] * d[0] + p[1] * d[1], d[0] * p[1] - d[1] * p[0]]));
    let long = (high[0] - low[0]) / (high[1] - low[1]);
    let slender = LONG[0] * (long - 1.0).max(0.0) + LONG[1] * (long.powi(-2) - 1.0).max(0.0);
    let shift = (0.5 * joint.cell.area.ln() - width.ln() + FAR) / FRAC_PI_2;
    [(shift * corner + slender) / stiffness, TURN * corner / (width * width)]
}

/// The root of a limb in a body, less than half of whose area lies before it; `deep`: it extends into an elastic one.
fn root(mouth: [f64; 2], limb: &Limb, end: usize, area: f64, deep: bool) -> [f64; 2] {
    let (e, w) = (limb.ends[end], limb.width[end]);
    let u = if end == 1 { limb.direction() } else { limb.direction().map(|x| -x) };
    let ahead = (mouth[0] - e[0]) * u[0] + (mouth[1] - e[1]) * u[1];
    let deep = if deep { ahead + ROOT * w } else { ahead };
    let fits = |t: &f64| t.abs() * w <= 0.5 * area && *t > -0.9 * limb.length();
    let t = [deep, ahead].into_iter().find(fits).unwrap_or(0.0);
    [e[0] + t * u[0], e[1] + t * u[1]]
}

/// For each limb whether it is a piece of a plate.
fn plates(axis: &Medial, parts: &LimbGraph, cut: &HoleCutouts, origin: [f64; 2], rule: &AnchorRule) -> Vec<bool> {
    let porosity = |k: usize| cut.limbs[k].moments.area / parts.limbs[k].cell.area;
    let compliance: Vec<f64> = (0..parts.limbs.len()).map(|k| compliance(&parts.limbs[k], porosity(k))).collect();
    let mut rigid: Vec<bool> = parts.limbs.iter().map(|limb| !rule.holds_limb(limb, origin)).collect();
    let held: Vec<bool> = parts.joints.iter().map(|joint| rule.holds_body(axis, origin, &parts.limbs, joint)).collect();
    loop {
        bimorph_base::budget::check();
        let mut sets = Sets::new(parts.joints.len());
        for k in (0..rigid.len()).filter(|k| rigid[*k]) {
            sets.join(parts.at[k][0], parts.at[k][1]);
        }
        // of each plate: cube root of the compliance of all its limbs in series, the largest of them, the least of the
        // supporting ones
        let mut plates = vec![(0.0, 0.0_f64, f64::INFINITY, f64::INFINITY); parts.joints.len()];
        for k in 0..rigid.len() {
            for j in parts.at[k].map(|j| sets.first(j)) {
                let (row, most, least, stretch) = &mut plates[j];
                if rigid[k] {
                    *row += 0.5 * compliance[k].cbrt();
                    *most = most.max(compliance[k]);
                } else {
                    *least = least.min(compliance[k]);
                    *stretch = stretch.min(slender(&parts.limbs[k]));
                }
            }
        }
        for j in (0..held.len()).filter(|j| held[*j]) {
            plates[sets.first(j)].2 = 0.0;
        }
        let before = rigid.clone();
        for k in (0..rigid.len()).filter(|k| before[*k]) {
            let (row, most, least, stretch) = plates[sets.first(parts.at[k][0])];
            let row: f64 = row.powi(3);
            rigid[k] = STIFF * row <= least && BENT * row <= stretch || compliance[k] < ALIKE * most;
        }
        if rigid == before {
            // what has no hole is no perforated plate
            let mut holes = vec![false; parts.joints.len()];
            for (j, lack) in cut.joints.iter().enumerate() {
                holes[sets.first(j)] |= lack.moments.area > 0.0;
            }
            for k in (0..rigid.len()).filter(|k| rigid[*k]) {
                holes[sets.first(parts.at[k][0])] |= cut.limbs[k].moments.area > 0.0;
            }
            return (0..rigid.len()).map(|k| rigid[k] && holes[sets.first(parts.at[k][0])]).collect();
        }
    }
}

/// Approximate transverse compliance of a limb: bending and shear (1).
fn compliance(limb: &Limb, porosity: f64) -> f64 {
    let slender = slender(limb);
    (slender.powi(3) + slender) / holes::stiffness(porosity)
}

/// Length over width (1): axial compliance times E·thickness.
fn slender(limb: &Limb) -> f64 {
    limb.length() / (0.5 * (limb.width[0] + limb.width[1]))
}
