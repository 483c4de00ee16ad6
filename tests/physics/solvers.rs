//! The solvers of step matrices: all of them find the solution of the recursion.

use bimorph::compile::{CompileOptions, compile};
use bimorph::equations::linear::LinearSolver;
use bimorph::multibody::planar::Pose;
use bimorph::multibody::{BodyMatrix, forces};
use bimorph::netlist::read_bundle;
use bimorph::solve::baseline::sparse::Sparse;
use bimorph::solve::baseline::{Solver, SolverKind};
use std::path::Path;

/// On the step matrix of the bank, from static (h large) to inertial (h small), every solver finds the solution of
/// the recursion. The residual of every row is at rounding, 1e-12 of the terms that it sums (1e-10 with exchanges).
#[test]
fn all_solvers_agree_on_step_matrices() {
    let bundle = read_bundle(Path::new("examples/bank/bank.net"), &[]).unwrap();
    let options = CompileOptions { segments: Some(4), ..CompileOptions::default() };
    let system = compile(&bundle, &options).unwrap().parts.system;
    let pattern = &system.model.pattern;
    let n = system.bodies();
    let zeros = vec![Pose::zeros(); n];
    let mut r = zeros.clone();
    for h in [1e-3, 1e-6, 1e-9] {
        let mut a = BodyMatrix::new(pattern);
        system.tangent(&zeros, &system.electrics.drive(), &mut a, &mut r);
        forces::add_inertia(&system.model, 1.0 / (h * h), 1.0 / h, &mut a);
        system.model.project_matrix(&mut a);
        let mut b: Vec<Pose> = (0..n)
            .map(|k| {
                let s = ((k * 7919) % 101) as f64 / 101.0 - 0.5;
                Pose::new(s * 1e-6, (0.3 - s) * 1e-6, s * s * 1e-11)
            })
            .collect();
        system.model.project(&mut b);
        for kind in SolverKind::ALL {
            let mut solver = Solver::new(kind, pattern).unwrap();
            let (mut matrix, mut x) = (a.clone(), b.clone());
            solver.factor(pattern, &mut matrix).unwrap();
            solver.solve(pattern, &matrix, &mut x);
            let mut back = zeros.clone();
            a.multiply_add(pattern, &x, &mut back);
            // what rounding may leave in a row is a share of the terms that the row adds up
            let mut sizes = a.clone();
            sizes.diagonal.iter_mut().chain(&mut sizes.below).for_each(|block| *block = block.abs());
            let magnitudes: Vec<Pose> = x.iter().map(|x| x.abs()).collect();
            let mut terms = zeros.clone();
            sizes.multiply_add(pattern, &magnitudes, &mut terms);
            let largest = terms.iter().map(|t| t.amax()).fold(0.0, f64::max);
            for (k, (got, want)) in back.iter().zip(&b).enumerate() {
                for (i, term) in terms[k].iter().enumerate() {
                    // an exchange of rows compares newtons with newton metres: it is as good as the largest row
                    let room = 1e-12 * if kind == SolverKind::Dense { largest } else { *term };
                    assert!((got - want)[i].abs() <= room, "{} {h} {k} {i}: {got} {want} {room:e}", kind.name());
                }
            }
        }
    }
}

/// The sparse solver's analysis is done on the couplings, without the recursion's fill, and its factor of a tree-like
/// bank is no larger than the recursion's by a half.
#[test]
fn sparse_factor_is_small() {
    let bundle = read_bundle(Path::new("examples/bank/bank.net"), &[]).unwrap();
    let options = CompileOptions { band: Some(1.3e6), ..CompileOptions::default() };
    let system = compile(&bundle, &options).unwrap().parts.system;
    let pattern = &system.model.pattern;
    let blocks = 6 * pattern.bodies() + 9 * pattern.off_blocks();
    let entries = Sparse::new(pattern).unwrap().entries();
    assert!(entries < blocks * 3 / 2, "{entries} {blocks}");
}
