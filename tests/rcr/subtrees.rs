//! Optimizations (runs of pins, small fronts in closed form, packs of equal subtrees) against the plain recursion, body
//! by body.

#[path = "../topologies/mod.rs"]
mod topologies;

use crate::mechanism::{Mechanism, PIN, Stream, WELD};
use bimorph::multibody::joint_coordinates::constrained_loops::{Linkage, Reduction, ReductionTask};
use bimorph::multibody::{BodyId, Model};

fn bits(of: &[f64]) -> Vec<u64> {
    of.iter().map(|x| x.to_bits()).collect()
}

/// Everything that a reduction shows, in bits.
fn shown(r: &Reduction<f64>, count: usize) -> Vec<u64> {
    let bodies = (0..count).flat_map(|k| [r.pose(k), r.rate(k), r.accelerations[k]]);
    bodies.flatten().chain([r.nearness]).map(f64::to_bits).collect()
}

/// Compares the recursion with packs, with every body on its own, and without anything that is there for speed alone,
/// at a random configuration, rates, forces and torques; `size` of the coordinates. Returns the number of bodies in
/// packs.
fn same_bits(model: &Model, seed: u64, size: f64) -> usize {
    let linkage = &Linkage::new(model);
    let (n, count) = (linkage.coordinates, linkage.links.len());
    let mut s = Stream(seed);
    let mut random = |scale: f64| (0..n).map(|_| scale * s.next()).collect::<Vec<f64>>();
    let (q, v, torque) = (random(size), random(1.0), random(1.0));
    let force: Vec<[f64; 3]> = (0..count).map(|_| [s.next(), s.next(), s.next()]).collect();
    let ways = [Reduction::<f64>::new(&[linkage]), Reduction::without_packs(&[linkage]), Reduction::plain(&[linkage])];
    let packed = ways[0].packed_bodies();
    assert_eq!([ways[1].packed_bodies(), ways[2].packed_bodies()], [0, 0]);
    let [first, others @ ..] = ways.map(|r| seen(r, linkage, (&q, &v), (&force, &torque)));
    for (which, other) in others.into_iter().enumerate() {
        assert_eq!(first.len(), other.len());
        for (a, b) in first.iter().zip(&other) {
            assert_eq!(a, b, "{}", ["without packs", "plain"][which]);
        }
    }
    packed
}

/// All that a reduction finds, in bits, each with what it is.
fn seen(
    mut r: Reduction<f64>,
    linkage: &Linkage,
    (q, v): (&[f64], &[f64]),
    (force, torque): (&[[f64; 3]], &[f64]),
) -> Vec<(String, Vec<u64>)> {
    let (n, count) = (linkage.coordinates, linkage.links.len());
    let mut seen = Vec::new();
    let mut out = vec![0.0; n];
    r.force.copy_from_slice(force);
    r.torque.copy_from_slice(torque);
    for task in
        [ReductionTask::Accelerations, ReductionTask::Rates, ReductionTask::Positions, ReductionTask::Accelerations]
    {
        let mut keep = |what: &str, bits: Vec<u64>| seen.push((format!("{what} {task:?}"), bits));
        r.place(q, v);
        r.reduce(task, &mut out);
        keep("coordinates", bits(&out));
        keep("bodies", shown(&r, count));
        keep("largest", bits(&[r.largest(task), r.kinetic_energy(linkage)]));
        let met = r.solve(task, &mut out);
        keep(&format!("{met:?} solve"), bits(&out));
        let met = r.reduce_singular(task, &mut out);
        keep(&format!("{met:?} singular"), bits(&out));
        keep("singular bodies", shown(&r, count));
    }
    r.accelerate(q, v, &mut out);
    seen.push(("at one go".into(), bits(&out)));
    let (mut q, mut v) = (q.to_vec(), v.to_vec());
    let gap = r.project_positions(&mut q, &v, &mut out);
    r.project_rates(&q, &mut v, &mut out);
    seen.push(("projection".into(), [bits(&q), bits(&v), bits(&[gap]), shown(&r, count)].concat()));
    seen
}

/// A hub on 3 to 20 arms: every arm but the one that carries the hub is in a pack, less the remainder of a full pack.
#[test]
fn arms_of_a_hub() {
    for count in 3..20 {
        let packed = same_bits(&topologies::arms(count, 2).pinned(), count as u64, 0.05);
        let arms = count - 1;
        assert_eq!(packed, 2 * if arms % 8 < 5 { arms - arms % 8 } else { arms }, "{count}");
    }
}

/// Bimorphs on yokes, yokes on stages, stages on a rotor, on pins and with flexible joints. Every bit is that of each
/// body on its own, and of twenty bimorphs on a yoke three bodies in four are in packs.
#[test]
fn bimorphs_on_yokes() {
    for (name, units) in [("bank", 5), ("bank", 20), ("quarter", 6), ("rotary", 2), ("arms", 9)] {
        let topology = topologies::named(name, units);
        for (kind, model, size) in [("pins", topology.pinned(), 0.05), ("flexible", topology.model(), 1e-8)] {
            let packed = same_bits(&model, units as u64, size);
            assert!(packed > 0, "{name} {units} {kind}");
            assert!(units < 20 || 4 * packed > 3 * model.bodies.len(), "{name} {units} {kind}: {packed}");
        }
    }
}

/// A mechanism without equal subtrees has no body in a pack.
#[test]
fn nothing_equal() {
    for model in [topologies::chain(50).pinned(), topologies::ladder(10, 1).pinned()] {
        assert_eq!(same_bits(&model, 1, 0.05), 0);
    }
}

/// As drawn, loops of straight arms and rails are singular: results that are not finite there are so with every
/// traversal, and zeros have the same sign.
#[test]
fn singular_as_drawn() {
    for (name, units) in [("ladder", 6), ("arms", 9), ("bank", 5)] {
        same_bits(&topologies::named(name, units).pinned(), 1, 0.0);
    }
}

/// Attaches `copies` of a random subtree to bodies of a trunk, which is drawn at `places`: up to four bodies with
/// joints of any kind, with loops inside, to ground and to the trunk. Its random properties besides its size come from
/// `shape`.
fn hang(m: &mut Mechanism, trunk: &[(BodyId, [f64; 2])], copies: usize, shape: u64, s: &mut Stream) {
    let kinds = [PIN, PIN, [false; 3], [true, false, true], [true, false, false]];
    for _ in 0..copies {
        let mut same = Stream(shape);
        let (size, on) = (1 + same.below(4), s.below(trunk.len() - 1));
        let mut bodies = vec![trunk[on]];
        for k in 0..size {
            let (up, place) = bodies[if same.next() > 0.0 { k } else { same.below(k + 1) }];
            let at = [place[0] + 2.0 * s.next(), place[1] + 2.0 * s.next()];
            let body = m.body(at, 1.0 + s.next().abs(), 0.3 + 0.2 * s.next());
            let joint = [0.5 * (at[0] + place[0]) + 0.2 * s.next(), 0.5 * (at[1] + place[1]) + 0.2 * s.next()];
            m.join(up, body, joint, s.next(), kinds[same.below(kinds.len())], [1.0; 3]);
            bodies.push((body, at));
        }
        let (last, [x, y]) = bodies[size];
        let at = [x + 0.5 * s.next(), y + 0.5 * s.next()];
        match same.below(5) {
            0 => m.join(last, BodyId::Ground, at, 0.3, PIN, [1.0; 3]),
            1 => m.join(bodies[0].0, last, at, 0.3, PIN, [1.0; 3]),
            2 => m.join(last, trunk[on + 1].0, at, 0.3, [true, false, false], [1.0; 3]),
            3 => m.join(last, trunk[on + 1].0, at, 0.3, WELD, [1.0; 3]),
            _ => {}
        }
    }
}

/// Random trunks with several kinds of equal subtrees, in numbers that do not fill packs, on one shared body or two: every bit
/// is that of each body on its own.
#[test]
fn random_trunks() {
    let (mut packed, mut bodies) = (0, 0);
    for seed in 0..60 {
        let mut s = Stream(seed);
        let mut m = Mechanism::default();
        let mut trunk = Vec::new();
        let mut up = BodyId::Ground;
        for k in 0..2 + s.below(4) {
            let at = [3.0 * k as f64, s.next()];
            let body = m.body(at, 5.0, 2.0);
            m.join(up, body, [at[0] - 1.5, at[1]], 0.0, if s.next() > 0.0 { PIN } else { [false; 3] }, [1.0; 3]);
            trunk.push((body, at));
            up = body;
        }
        for group in 0..3 {
            let copies = 3 + s.below(16);
            hang(&mut m, &trunk, copies, 100 * seed + group, &mut s);
        }
        let (model, _) = m.model();
        packed += same_bits(&model, seed + 7, 0.2);
        bodies += model.bodies.len();
    }
    assert!(5 * packed > 2 * bodies, "{packed} of {bodies}");
}
