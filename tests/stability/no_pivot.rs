//! Elimination without pivots against the recursion, on a bank of bimorphs.

use super::bank::Bank;
use super::mechanism::Stream;
use super::symbolic::{Chosen, Symbolic};
use bimorph::multibody::Model;
use bimorph::multibody::forces::RestStrain;
use bimorph::multibody::joint_coordinates::TreeParent;
use bimorph::multibody::joint_coordinates::constrained_loops::{Linkage, Reduction, ReductionTask};
use bimorph::solve::dormand_prince::{DormandPrince, SecondOrder, Tolerances};
use bimorph::solve::joint_motion::JointMotion;

const NO_HEAT: RestStrain<'_> = RestStrain { expansion: &[], built_in: 1.0 };
/// A lever that makes accelerations of rotation comparable (m): a quarter of an arm.
const LEVER: f64 = 50e-6;

struct Case {
    bank: Bank,
    model: Model,
    place: Vec<usize>,
    linkage: Linkage,
}

impl Case {
    fn new(count: usize) -> Self {
        let bank = Bank::new(count);
        let (model, place) = bank.mechanism.model();
        let linkage = Linkage::new(&model);
        Self { bank, model, place, linkage }
    }

    /// Joint coordinates bent by `size` (rad) at random, on the loops.
    fn bent(&self, size: f64) -> Vec<f64> {
        let mut s = Stream(3);
        let n = self.linkage.coordinates;
        let mut q: Vec<f64> = (0..n).map(|_| size * s.next()).collect();
        for link in &self.linkage.links {
            if link.parent == TreeParent::Free {
                q[link.first] *= LEVER;
                q[link.first + 1] *= LEVER;
            }
        }
        Reduction::<f64>::new(&[&self.linkage]).project_positions(&mut q, &vec![0.0; n], &mut vec![0.0; n]);
        q
    }

    fn symbolic(&self, chosen: Chosen, r: &Reduction<f64>, force: &[[f64; 3]]) -> Symbolic {
        let of = |k: usize| &self.model.bodies[self.place[k]];
        let masses: Vec<[f64; 2]> = (0..self.place.len()).map(|k| [of(k).mass, of(k).inertia]).collect();
        let p = &self.place;
        Symbolic::new(&self.bank, chosen, &masses, &|k| r.pose(p[k]), &|k| r.rate(p[k]), &|k| force[p[k]])
    }
}

/// Largest difference against the largest acceleration; infinite for NaN.
fn apart(a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64, n: usize) -> f64 {
    let unit = |i: usize| if i % 3 == 2 { LEVER } else { 1.0 };
    let largest = (0..n).map(|i| (b(i) * unit(i)).abs()).fold(0.0, f64::max);
    let difference = (0..n).map(|i| ((a(i) - b(i)) * unit(i)).abs());
    difference.fold(0.0, |m: f64, x| if x.is_nan() { f64::INFINITY } else { m.max(x) }) / largest
}

/// Relative errors of the accelerations of a bank of `count` bimorphs bent by `bent` (rad): without pivots, and ours.
pub(crate) fn errors(chosen: Chosen, count: usize, bent: f64) -> (f64, f64) {
    let case = Case::new(count);
    let n = case.linkage.coordinates;
    let mut r = Reduction::<f64>::new(&[&case.linkage]);
    r.place(&case.bent(bent), &vec![0.0; n]);
    for (k, &p) in case.place.iter().enumerate() {
        r.force[p] = [1e-6 * (k as f64).sin(), 1e-6 * (k as f64).cos(), 1e-11];
    }
    let symbolic = case.symbolic(chosen, &r, &r.force);
    r.solve(ReductionTask::Accelerations, &mut vec![0.0; n]);
    let (judge, blind) = (symbolic.judge(), symbolic.accelerations());
    let ours = |i: usize| r.accelerations[case.place[i / 3]][i % 3];
    (apart(&|i| blind[i], &|i| judge[i], judge.len()), apart(&ours, &|i| judge[i], judge.len()))
}

/// The equations of motion with accelerations without pivots.
struct Blind<'a> {
    case: &'a Case,
    chosen: Chosen,
    reduction: Reduction<f64>,
}

fn push(case: &Case, q: &[f64], r: &mut Reduction<f64>) {
    r.add_elastic(&case.linkage, q, &NO_HEAT);
    // a micronewton on the first yoke, across the arms
    r.force[case.place[9]][1] += 1e-6;
}

impl SecondOrder for Blind<'_> {
    type Error = ();

    fn dimension(&self) -> usize {
        self.case.linkage.coordinates
    }

    fn accelerations(&mut self, _: f64, q: &[f64], v: &[f64], a: &mut [f64]) -> Result<(), ()> {
        let (r, case) = (&mut self.reduction, self.case);
        r.place(q, v);
        r.force.fill([0.0; 3]);
        r.torque.fill(0.0);
        push(case, q, r);
        // springs of the tree as moments on the bodies
        let mut force = r.force.clone();
        for (body, link) in case.linkage.links.iter().enumerate() {
            if link.parent == TreeParent::Free {
                continue;
            }
            let moment = link.sign * r.torque[link.first];
            force[body][2] += moment;
            if let TreeParent::Body(p) = link.parent {
                force[p as usize][2] -= moment;
            }
        }
        let bodies = case.symbolic(self.chosen, r, &force).accelerations();
        let mut of = vec![[0.0; 3]; case.place.len()];
        for (k, &p) in case.place.iter().enumerate() {
            of[p] = [bodies[3 * k], bodies[3 * k + 1], bodies[3 * k + 2]];
        }
        for (body, link) in case.linkage.links.iter().enumerate() {
            match link.parent {
                TreeParent::Free => a[link.first..link.first + 3].copy_from_slice(&of[body]),
                TreeParent::Ground => a[link.first] = link.sign * of[body][2],
                TreeParent::Body(p) => a[link.first] = link.sign * (of[body][2] - of[p as usize][2]),
            }
        }
        if a.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(()) }
    }

    fn project(&mut self, _: f64, q: &mut [f64], v: &mut [f64]) -> Result<(), ()> {
        let mut change = vec![0.0; q.len()];
        self.reduction.project_positions(q, v, &mut change);
        self.reduction.project_rates(q, v, &mut change);
        Ok(())
    }
}

/// How an integration went: time reached (s), accelerations evaluated, displacement of the first yoke over time (t, y) (m).
#[derive(Debug, Clone, Default)]
pub(crate) struct Run {
    pub(crate) reached: f64,
    pub(crate) evaluations: u64,
    pub(crate) track: Vec<[f64; 2]>,
}

const END: f64 = 0.5e-6;
const MAX_STEPS: u64 = 3000;

fn integrate<P: SecondOrder>(case: &Case, problem: &mut P, q: &mut [f64]) -> Run {
    let n = case.linkage.coordinates;
    let mut v = vec![0.0; n];
    let mut atol_q = vec![1e-10; n];
    for link in &case.linkage.links {
        if link.parent == TreeParent::Free {
            atol_q[link.first] = 1e-14;
            atol_q[link.first + 1] = 1e-14;
        }
    }
    let atol_v = atol_q.iter().map(|x| x * 1e6).collect();
    let bounds = Tolerances { rtol: 1e-6, atol_q, atol_v };
    let mut method = DormandPrince::new(n);
    let (mut h, mut run) = (0.0, Run::default());
    let mut placed = Reduction::<f64>::new(&[&case.linkage]);
    let mut last = vec![0.0; n];
    let mut rate = vec![0.0; n];
    let _ = method.integrate(problem, (0.0, END), q, &mut v, &mut h, &bounds, MAX_STEPS, &mut |dense| {
        dense.at(dense.t + dense.h, &mut last, &mut rate);
        placed.place(&last, &rate);
        run.reached = dense.t + dense.h;
        run.track.push([run.reached, placed.pose(case.place[9])[1]]);
        true
    });
    run.evaluations = method.effort.accelerations;
    run
}

/// Integrates a bank of `count` bimorphs from `bent` (rad) for 2 µs under a sudden force: without pivots, and ours.
pub(crate) fn runs(chosen: Chosen, count: usize, bent: f64) -> (Run, Run) {
    let case = Case::new(count);
    let mut q = case.bent(bent);
    let mut blind = Blind { case: &case, chosen, reduction: Reduction::new(&[&case.linkage]) };
    let without = integrate(&case, &mut blind, &mut q.clone());
    let mut motion =
        JointMotion::new(&case.linkage, |_: f64, q: &[f64], _: &[f64], r: &mut Reduction<f64>| push(&case, q, r));
    (without, integrate(&case, &mut motion, &mut q))
}

/// As drawn, elimination without pivots is right for one bimorph and has no number for two or more; the recursion is right
/// for all. The speeds chosen next to the closing pins fail for one already.
#[test]
fn past_one_bimorph() {
    for count in 1..=6 {
        let (blind, ours) = errors(Chosen::First, count, 0.0);
        assert!(ours < 1e-12, "{count}: {ours:e}");
        assert!(if count == 1 { blind < 1e-12 } else { blind.is_infinite() }, "{count}: {blind:e}");
    }
    assert!(errors(Chosen::Last, 1, 0.0).0.is_infinite());
}

/// Nearly as drawn, two bimorphs bent by rounding (1e-14 rad): two digits without pivots. Bent by 1e-3 rad both are right.
#[test]
fn nearly_straight() {
    let (blind, ours) = errors(Chosen::First, 2, 1e-14);
    assert!(blind > 1e-4 && ours < 1e-12, "{blind:e} {ours:e}");
    let (blind, ours) = errors(Chosen::First, 2, 1e-3);
    assert!(blind < 1e-11 && ours < 1e-12, "{blind:e} {ours:e}");
}

/// With error control, from straight arms: one bimorph runs, two cannot begin. With the other choice of speeds, two
/// bimorphs bent by 1e-4 rad come to a stand when a flexure swings through the straight.
#[test]
fn integration() {
    let (blind, ours) = runs(Chosen::First, 1, 0.0);
    assert!(blind.reached == END && ours.reached == END);
    let (blind, ours) = runs(Chosen::First, 2, 0.0);
    assert!(blind.reached == 0.0 && ours.reached == END);
    let (blind, ours) = runs(Chosen::Last, 2, 1e-4);
    assert!(blind.reached < 0.5 * END && ours.reached == END, "{} {}", blind.reached, ours.reached);
}
