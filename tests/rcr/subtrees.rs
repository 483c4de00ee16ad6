//! Equal subtrees side by side against the recursion with every body on its own.

#[path = "../topologies/mod.rs"]
mod topologies;

use crate::mechanism::{Mechanism, PIN, Stream, WELD};
use bimorph::multibody::rcr::{Linkage, Reduction, Task};
use bimorph::multibody::{BodyId, Model};

fn bits(of: &[f64]) -> Vec<u64> {
    of.iter().map(|x| x.to_bits()).collect()
}

/// Everything that a reduction shows, in bits.
fn shown(r: &Reduction<f64>, count: usize) -> Vec<u64> {
    let bodies = (0..count).flat_map(|k| [r.pose(k), r.rate(k), r.accelerations[k]]);
    bodies.flatten().chain([r.nearness]).map(f64::to_bits).collect()
}

/// Compares both recursions at a random configuration, rates, forces and torques; `size` of the coordinates. Returns how many
/// bodies go side by side.
fn same_bits(model: &Model, seed: u64, size: f64) -> usize {
    let linkage = &Linkage::new(model);
    let (n, count) = (linkage.coordinates, linkage.links.len());
    let mut s = Stream(seed);
    let mut random = |scale: f64| (0..n).map(|_| scale * s.next()).collect::<Vec<f64>>();
    let (q, v, torque) = (random(size), random(1.0), random(1.0));
    let mut packed = Reduction::<f64>::new(&[linkage]);
    let mut single = Reduction::<f64>::without_packs(&[linkage]);
    let force: Vec<[f64; 3]> = (0..count).map(|_| [s.next(), s.next(), s.next()]).collect();
    for r in [&mut packed, &mut single] {
        r.force.copy_from_slice(&force);
        r.torque.copy_from_slice(&torque);
    }
    let (mut a, mut b) = (vec![0.0; n], vec![0.0; n]);
    for task in [Task::Accelerations, Task::Rates, Task::Positions, Task::Accelerations] {
        for (r, out) in [(&mut packed, &mut a), (&mut single, &mut b)] {
            r.place(linkage, &q, &v);
            r.reduce(linkage, task, out);
        }
        assert_eq!(bits(&a), bits(&b), "{task:?}");
        assert_eq!(shown(&packed, count), shown(&single, count), "{task:?}");
        assert_eq!(packed.largest(task).to_bits(), single.largest(task).to_bits());
        assert_eq!(packed.solve(linkage, task, &mut a), single.solve(linkage, task, &mut b));
        assert_eq!(bits(&a), bits(&b), "{task:?}");
        assert_eq!(packed.reduce_singular(linkage, task, &mut a), single.reduce_singular(linkage, task, &mut b));
        assert_eq!(bits(&a), bits(&b), "singular {task:?}");
        assert_eq!(packed.kinetic_energy(linkage).to_bits(), single.kinetic_energy(linkage).to_bits());
    }
    packed.accelerate(linkage, &q, &v, &mut a);
    single.accelerate(linkage, &q, &v, &mut b);
    assert_eq!(bits(&a), bits(&b));
    let mut moved = [(q.clone(), v.clone()), (q, v)];
    let mut gaps = [0.0; 2];
    for ((r, (q, v)), gap) in [&mut packed, &mut single].into_iter().zip(&mut moved).zip(&mut gaps) {
        *gap = r.project_positions(linkage, q, v, &mut a);
        r.project_rates(linkage, q, v, &mut a);
    }
    assert_eq!(gaps[0].to_bits(), gaps[1].to_bits());
    assert_eq!((bits(&moved[0].0), bits(&moved[0].1)), (bits(&moved[1].0), bits(&moved[1].1)));
    assert_eq!(shown(&packed, count), shown(&single, count));
    packed.side_by_side()
}

/// A hub on 3 to 20 arms: every arm but the one that carries the hub goes side by side, less what does not fill a pack.
#[test]
fn arms_of_a_hub() {
    for count in 3..20 {
        let packed = same_bits(&topologies::arms(count, 2).pinned(), count as u64, 0.05);
        let arms = count - 1;
        assert_eq!(packed, 2 * if arms % 8 < 5 { arms - arms % 8 } else { arms }, "{count}");
    }
}

/// Bimorphs on yokes, yokes on stages, stages on a rotor, on pins and with flexible joints: every bit is that of each body on
/// its own, and of twenty bimorphs on a yoke three bodies in four go side by side.
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

/// A mechanism without equal subtrees has no body side by side.
#[test]
fn nothing_equal() {
    for model in [topologies::chain(50).pinned(), topologies::ladder(10, 1).pinned()] {
        assert_eq!(same_bits(&model, 1, 0.05), 0);
    }
}

/// Hangs `copies` of a random subtree on bodies of a trunk, which is drawn at `places`: up to four bodies with joints of any
/// kind, with loops inside, to ground and to the trunk. What is random of it besides its size comes from `shape`.
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
