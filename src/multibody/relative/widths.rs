//! What goes side by side has the same bits whatever the width of the processor's registers.

use super::columns::Four;
use super::factor::Eliminate;
use super::placed::{Eights, Place, Placed};
use super::solve::Solve;
use super::{JointMatrix, Tree};
use crate::compile::{CompileOptions, Scheme, compile};
use crate::multibody::lanes::one_by_one;
use crate::multibody::planar::Pose;
use crate::netlist::Bundle;
use pulp::{Scalar, Simd};

/// A frame with a loop, eleven bodies: a whole tile and a part of one.
const FRAME: &str = "process p = [Youngsmodulus=165e9 density=2300 h=2u]
    anchor p [a] [l=10u w=10u]
    anchor p [b] [l=10u w=10u]
    beam2d p [a k] [l=90u w=2u oz=0.3]
    beam2d p [k t] [l=60u w=3u oz=-0.2]
    beam2d p [b t] [l=110u w=2u oz=2.1]
    beam2d p [t s] [l=40u w=5u oz=1.2]";

/// Placing, factoring and solving as this processor does them, and one number after the other: the same bits.
#[test]
fn bits_do_not_depend_on_registers() {
    let options = CompileOptions { scheme: Scheme::Es, segments: Some(3), ..CompileOptions::default() };
    let compiled = compile(&Bundle::from_text("frame", FRAME), &options).unwrap();
    let model = &compiled.parts.system.model;
    let tree = Tree::elastic(model).unwrap();
    let mut seed = 7u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let mut poses = |size: f64| -> Vec<Pose> {
        (0..model.bodies.len())
            .map(|_| Pose::new(noise() * size * 1e-6, noise() * size * 1e-6, noise() * size))
            .collect()
    };
    // angles beyond the short series of the sine are among them
    let given = Eights::tiles(&poses(2.0), &poses(1e5), &poses(1e11));
    let (mut here, mut alone) = (Placed::new(&tree), Placed::new(&tree));
    here.place(&tree, &given);
    one_by_one(Place { placed: &mut alone, tree: &tree, given: &given });
    assert_eq!((&here.at, &here.rate, &here.acceleration), (&alone.at, &alone.rate, &alone.acceleration));
    let mut matrix = JointMatrix::new(&tree);
    for (block, body) in matrix.bodies.diagonal.iter_mut().zip(&model.bodies) {
        *block = nalgebra::Matrix3::from_diagonal(&(body.mass_diagonal() * 1e16));
    }
    let mut other = matrix.clone();
    matrix.factor(&tree, &here, 1.0, None).unwrap();
    for (j, map) in other.maps.iter_mut().enumerate() {
        *map = alone.map(j);
    }
    Scalar::new().vectorize(Eliminate { matrix: &mut other, tree: &tree, scale: 1.0, geometric: None }).unwrap();
    let mut fours = |size: f64| poses(size).into_iter().chain([Pose::zeros()]).map(Four::from).collect::<Vec<_>>();
    let (mut wrench, mut x) = (fours(1e-6), fours(1e-6));
    let (mut wrench_alone, mut x_alone) = (wrench.clone(), x.clone());
    matrix.solve(&mut wrench, &mut x);
    Scalar::new().vectorize(Solve { factors: &other.factors, wrench: &mut wrench_alone, x: &mut x_alone });
    assert!(x.iter().any(|x| x.pose() != Pose::zeros()));
    assert_eq!((wrench, x), (wrench_alone, x_alone));
}
