//! How long the first step in time is.

use bimorph_domains::System;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;

/// A cautious first step: the error control corrects it within a few steps either way.
pub fn first_step(system: &System, interval: f64) -> f64 {
    // a tenth of a radian of the fastest translation that a body and its own joints would make
    let model = &system.model;
    let mut tangent = BodyMatrix::new(&model.pattern);
    let zeros = vec![Pose::zeros(); system.bodies()];
    let mut r = zeros.clone();
    system.tangent(&zeros, &system.electrics.drive(), &mut tangent, &mut r);
    let fastest = (0..system.bodies())
        .filter(|&j| model.mass(j).x > 0.0)
        .map(|j| (tangent.diagonal[j].fixed_view::<2, 2>(0, 0).norm() / model.mass(j).x).sqrt())
        .fold(0.0, f64::max);
    if fastest > 0.0 { interval.min(1.0 / fastest) } else { interval }
}
