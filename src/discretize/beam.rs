//! A beam of the drawing as bodies and joints of a model, cut by a [`Scheme`](super::scheme::Scheme).

use super::DiscretizeOptions;
use super::rigid::{Assembly, Lump};
use super::scheme::{Bar, Scheme};
use crate::gaps::Point;
use crate::multibody::{BodyId, BodyName, Coupling, Joint};
use crate::structure::Beam;
use nalgebra::Vector2;
use std::sync::Arc;

/// Shear coefficient of a rectangular section: G·As = κ·G·A.
pub const SHEAR_COEFFICIENT: f64 = 5.0 / 6.0;

/// What the options leave of a beam: an Euler–Bernoulli beam unless shear or rotary inertia are asked for.
pub fn bar(beam: &Beam, shear: bool, rotary: bool) -> Bar {
    let m = &beam.material;
    let area = beam.width * beam.thickness;
    let inertia = beam.thickness * beam.width.powi(3) / 12.0;
    let shear_modulus = m.youngs_modulus / (2.0 * (1.0 + m.poisson));
    Bar {
        length: beam.length,
        ea: m.youngs_modulus * area,
        ei: m.youngs_modulus * inertia,
        shear: if shear { 1.0 / (SHEAR_COEFFICIENT * shear_modulus * area) } else { 0.0 },
        line_mass: m.density * beam.width * beam.thickness,
        rotary: if rotary { beam.width * beam.width / 12.0 } else { 0.0 },
    }
}

/// Joints of the model in the making.
#[derive(Debug, Clone, Default)]
pub struct Joints {
    /// Joints, `Free(k)` being body k of the assembly.
    pub joints: Vec<Joint>,
    /// Pairs of joints whose rotations are coupled.
    pub couplings: Vec<Coupling>,
}

/// Lays a beam: adds its inner bodies, masses and joints. Returns the equally spaced points along it, ends included.
pub fn lay(
    beam: &Beam,
    segments: usize,
    heater: Option<usize>,
    options: &DiscretizeOptions,
    rigid: &mut Assembly,
    out: &mut Joints,
) -> Vec<Point> {
    let (start, end) = (rigid.position(beam.a.0), rigid.position(beam.b.0));
    let bar = bar(beam, options.shear, options.rotary_inertia);
    // a rigid beam is the rods of a single segment, which its one body holds together
    let scheme = if segments == 0 { Scheme::B } else { options.scheme };
    let segments = segments.max(1);
    let cut = scheme.cut(&bar, segments, rigid.grounded(beam.b.0));
    let name = Arc::from(beam.name.as_str());
    let last = cut.parts.len() - 1;
    let place = |at: f64| start + (end - start) * (at / beam.length);
    let bodies: Vec<Point> = (0..=last)
        .map(|k| match k {
            0 => rigid.point(beam.a.0),
            k if k == last => rigid.point(beam.b.0),
            k => rigid.add_segment(BodyName::segment(&name, k), place(cut.parts[k].at)),
        })
        .collect();
    let m = &beam.material;
    let drag_per_mass =
        if options.undamped || m.viscosity == 0.0 { 0.0 } else { m.viscosity / (m.fluid * m.density * beam.thickness) };
    let along = Vector2::new(beam.angle.cos(), beam.angle.sin());
    for (part, &point) in cut.parts.iter().zip(&bodies) {
        if part.mass > 0.0 {
            let lump = Lump { amount: part.mass, first: along * part.first, second: part.second };
            rigid.add_mass(point, &lump, drag_per_mass);
        }
    }
    let strain = beam.temperature.map_or(0.0, |t| m.thermal_expansion * (t - m.ambient_temperature))
        - m.stress / m.youngs_modulus;
    for (pin, ends) in cut.pins.iter().zip(bodies.windows(2)) {
        let (a, b) = (ends[0], ends[1]);
        if a.body == b.body {
            continue; // both ends on one rigid body: nothing can strain
        }
        out.joints.push(Joint {
            a: a.body,
            b: b.body,
            frame: rigid.frame_at(a, b, place(pin.at), beam.angle),
            stiffness: pin.stiffness,
            second: pin.second,
            expansion: heater.map(|group| (group, pin.length)),
            rest: pin.length * strain,
            locked: pin.locked,
        });
    }
    let pair = |k: usize| (bodies[k].body, bodies[k + 1].body);
    for &(i, j, stiffness) in &cut.couplings {
        out.couplings.push(Coupling { first: pair(i), second: pair(j), stiffness });
    }
    let points = cut.nodes.iter().enumerate().map(|(k, &part)| {
        let (body, at) = (bodies[part], k as f64 * beam.length / segments as f64);
        let beside = if body.body == BodyId::Ground { Vector2::zeros() } else { place(at) - place(cut.parts[part].at) };
        Point { arm: body.arm + beside, ..body }
    });
    points.collect()
}
