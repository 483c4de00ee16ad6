//! Parts that nothing connects to ground: an equilibrium leaves them where they are drawn, and their rigid-body modes are at 0 Hz.
//!
//! The stiffness of such a part is singular along its three rigid-body motions. The equilibrium holds one of its bodies
//! with an artificial stiffness ([`Model::factor_holding`](bimorph_multibody::Model::factor_holding)). Where the loads
//! on the part balance each other, this stiffness transmits no force, and every strain is exact.

use bimorph_domains::{Drive, System};
use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyMatrix, Model};
use bimorph_solve::eigen::Modes;
use nalgebra::Vector2;

/// Force through what holds a loose part, as a fraction of all forces, from which loads do not balance (1).
const UNBALANCED: f64 = 1e-6;
/// λ of a rigid-body mode, as a fraction of the highest found, is below this (1): it is rounding.
const RIGID: f64 = 1e-9;
/// Strain energy of a rigid-body mode, as a fraction of that of its bodies moving one by one, is below this (1).
const UNSTRAINED: f64 = 1e-9;

/// The first loose part whose loads do not balance at `q` under `drive`, with the direction of the net load.
pub(super) fn unbalanced(system: &System, q: &[Pose], drive: &Drive) -> Option<ZeroPivot> {
    system.model.loose().next()?;
    let (mut left, mut drawn) = (q.to_vec(), vec![Pose::zeros(); q.len()]);
    system.residual(&drawn.clone(), drive, &mut drawn);
    system.residual(q, drive, &mut left);
    // sizes that do not depend on the directions of the axes
    let force: f64 = drawn.iter().map(|r| r.xy().norm()).sum();
    let reach = system.model.bodies.iter().map(|body| body.center.norm()).fold(0.0, f64::max);
    let moment = drawn.iter().map(|r| r.z.abs()).sum::<f64>().max(force * reach);
    system.model.loose().find_map(|body| {
        let over = |direction: usize| {
            let scale = if direction == 2 { moment } else { force };
            left[body][direction].abs() > UNBALANCED * scale
        };
        (0..DOF).find(|&direction| over(direction)).map(|direction| ZeroPivot { body, direction })
    })
}

/// Takes from forces on loose parts those that move each as a rigid body: m·a at every body, with the acceleration of the part (inertia relief).
pub(super) fn relieve(model: &Model, force: &mut [Pose]) {
    for part in model.loose_parts() {
        let bodies = || part.iter().map(|&k| k as usize);
        let mass: f64 = bodies().map(|k| model.bodies[k].mass).sum();
        if mass <= 0.0 {
            continue;
        }
        let center = bodies().map(|k| model.bodies[k].center * model.bodies[k].mass).sum::<Vector2<f64>>() / mass;
        let arm = |k: usize| model.bodies[k].center - center;
        let inertia: f64 =
            bodies().map(|k| model.bodies[k].inertia + model.bodies[k].mass * arm(k).norm_squared()).sum();
        let along = bodies().map(|k| force[k].xy()).sum::<Vector2<f64>>() / mass;
        let moment: f64 = bodies().map(|k| force[k].z + arm(k).perp(&force[k].xy())).sum();
        let turns = if inertia > 0.0 { moment / inertia } else { 0.0 };
        for k in bodies() {
            let (body, r) = (&model.bodies[k], arm(k));
            let push = (along + Vector2::new(-r.y, r.x) * turns) * body.mass;
            force[k] -= Pose::new(push.x, push.y, body.inertia * turns);
        }
    }
}

/// The motions that an equilibrium holds, as sentences; of a loose part one for all three directions.
pub(super) fn free_motions(system: &System, held: &[ZeroPivot]) -> Vec<String> {
    let loose: Vec<usize> = system.model.loose().collect();
    let name = |body: usize| &system.model.bodies[body].name;
    let mut motions: Vec<String> = Vec::new();
    for pivot in held {
        let motion = if loose.contains(&pivot.body) {
            format!("the part with body \"{}\" is connected to no anchor, and its loads balance", name(pivot.body))
        } else {
            let direction = bimorph_solve::DIRECTIONS[pivot.direction];
            format!("body \"{}\" can move {direction}, nothing resists it and no load excites it", name(pivot.body))
        };
        if !motions.contains(&motion) {
            motions.push(motion);
        }
    }
    motions
}

/// Sets λ of rigid-body modes to exactly zero; true for each mode that is one.
pub(super) fn settle_rigid(system: &System, stiffness: &BodyMatrix, found: &mut Modes) -> Vec<bool> {
    let model = &system.model;
    let highest = found.lambda.iter().fold(0.0, |m: f64, l| m.max(l.abs()));
    let mut of = vec![Pose::zeros(); system.bodies()];
    let rigid: Vec<bool> = (found.lambda.iter().zip(&found.shapes))
        .map(|(lambda, shape)| {
            if lambda.abs() > RIGID * highest {
                return false;
            }
            of.fill(Pose::zeros());
            stiffness.multiply_add(&model.pattern, shape, &mut of);
            model.project(&mut of);
            let strain: f64 = shape.iter().zip(&of).map(|(x, y)| x.dot(y)).sum();
            let alone: f64 = shape.iter().zip(&stiffness.diagonal).map(|(x, k)| x.dot(&(k * x))).sum();
            strain.abs() <= UNSTRAINED * alone.abs()
        })
        .collect();
    for (lambda, _) in found.lambda.iter_mut().zip(&rigid).filter(|(_, rigid)| **rigid) {
        *lambda = 0.0;
    }
    rigid
}

/// Warning about rigid-body modes; none without any.
pub(super) fn warning(system: &System, rigid: usize) -> Option<String> {
    let parts: Vec<String> =
        system.model.loose().take(3).map(|b| format!("`{}`", system.model.bodies[b].name)).collect();
    let why = match parts.as_slice() {
        [] => "a mechanism, or a part that supports leave free in some direction".to_owned(),
        some => format!("the part with body {} is connected to no anchor", some.join(", ")),
    };
    (rigid > 0).then(|| {
        format!("{rigid} of the modes are rigid-body motions, which nothing resists, and are shown at 0 Hz: {why}")
    })
}
