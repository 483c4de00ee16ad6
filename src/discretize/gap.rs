//! Combs, lumped plates, facing beams and stops → gap functions.

use super::rigid::Assembly;
use crate::gaps::approach::Approach;
use crate::gaps::capacitor::Capacitor;
use crate::gaps::contact::{Contact, touching_distance};
use crate::gaps::facing::Facing;
use crate::gaps::stop::Stop;
use crate::gaps::{Gap, Point};
use crate::multibody::BodyId;
use crate::structure::Structure;
use nalgebra::Vector2;

/// Gaps in the order combs, plates, facing beams, stops; their names; and the pairs of bodies they couple. `chord`: facing beams as SUGAR
/// has them.
pub fn lay(structure: &Structure, rigid: &Assembly, chord: bool) -> (Vec<Gap>, Vec<String>, Vec<(BodyId, BodyId)>) {
    let mut gaps = Vec::new();
    let mut names = Vec::new();
    let mut couplings = Vec::new();
    for comb in &structure.combs {
        let approach = approach(rigid, comb.a.0, comb.b.0, comb.axis);
        let slope = comb.gaps * comb.permittivity * comb.height / comb.gap;
        let overlap = if comb.finite { comb.overlap } else { f64::INFINITY };
        let capacitor = Capacitor::Comb { slope, overlap, blend: comb.gap, parasitic: comb.parasitic };
        couplings.push((approach.a.body, approach.b.body));
        gaps.push(Gap::Single { approach, capacitor, contact: None });
        names.push(comb.name.clone());
    }
    for plate in &structure.plate_gaps {
        let approach = approach(rigid, plate.a.0, plate.b.0, plate.axis);
        let contact = Contact { touch: plate.touch.unwrap_or(touching_distance(plate.gap)), area: plate.area };
        let strength = plate.permittivity * plate.area;
        let capacitor = Capacitor::Plates { strength, gap: plate.gap, closest: contact.least() };
        couplings.push((approach.a.body, approach.b.body));
        gaps.push(Gap::Single { approach, capacitor, contact: Some(contact) });
        names.push(plate.name.clone());
    }
    for pair in &structure.beam_gaps {
        let normal = pair.angle + pair.side * std::f64::consts::FRAC_PI_2;
        let axis = [normal.cos(), normal.sin()];
        let [a, b, c, d] = pair.nodes.map(|n| n.0);
        let ends = [approach(rigid, a, c, axis), approach(rigid, b, d, axis)];
        let bodies = [ends[0].a.body, ends[1].a.body, ends[0].b.body, ends[1].b.body];
        for i in 0..4 {
            for j in 0..i {
                couplings.push((bodies[i], bodies[j]));
            }
        }
        let facing = Facing {
            length: pair.length,
            gap: pair.gap,
            strength: pair.permittivity * pair.height * pair.fringe,
            height: pair.height,
            touch: pair.touch.unwrap_or(touching_distance(pair.gap)),
            chord,
        };
        gaps.push(Gap::Facing { ends, side: pair.side, facing });
        names.push(pair.name.clone());
    }
    for stop in &structure.stops {
        let b = stop.b.map_or(Point { body: BodyId::Ground, arm: Vector2::zeros() }, |b| rigid.point(b.0));
        let approach = Approach { a: rigid.point(stop.a.0), b, axis: Vector2::new(stop.axis[0], stop.axis[1]) };
        let law = stop.stiffness.map_or(Stop::Rigid(stop.area), Stop::Elastic);
        couplings.push((approach.a.body, approach.b.body));
        gaps.push(Gap::Stop { approach, ways: stop.ways, stop: law });
        names.push(stop.name.clone());
    }
    (gaps, names, couplings)
}

fn approach(rigid: &Assembly, a: usize, b: usize, axis: [f64; 2]) -> Approach {
    Approach { a: rigid.point(a), b: rigid.point(b), axis: Vector2::new(axis[0], axis[1]) }
}

/// The gap with its points about centres of mass.
pub fn centered(gap: Gap, moved: &dyn Fn(Point) -> Point) -> Gap {
    let shift = |a: Approach| Approach { a: moved(a.a), b: moved(a.b), ..a };
    match gap {
        Gap::Single { approach, capacitor, contact } => Gap::Single { approach: shift(approach), capacitor, contact },
        Gap::Facing { ends: [first, second], side, facing } => {
            Gap::Facing { ends: [shift(first), shift(second)], side, facing }
        }
        Gap::Stop { approach, ways, stop } => Gap::Stop { approach: shift(approach), ways, stop },
    }
}
