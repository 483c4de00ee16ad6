//! The speed of an impact that restitution is measured at, from statics of the drawn mechanism.
//!
//! A plate of the frequency ω₀ at its pull-in voltage falls through the gap g to where it touches, t, and arrives with
//! ```text
//! v = ω₀·g·√((8/27)·(g/t − 1) − (1 − t/g)²)
//! ```
//! Fingers that lie in the middle of their gaps snap to the side at their pull-in voltage over the distance r to where they touch, and arrive with
//! v = ω₀·r²/√(g² − r²). A part released at the distance w of a stop passes its rest position at the speed ω₀·w. ω₀ is Rayleigh's
//! quotient of the shape that the load bends the drawn mechanism into: the field of the gaps at one voltage, or a force
//! along a stop or across fingers. Gaps at the same voltage fall together, combs alone. Neither stress nor voltage enters, so that the speed is a
//! constant of the element.

use super::contact_loss::Loss;
use super::domain::{Configuration, Domain};
use super::system::System;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, forces};
use std::collections::BTreeMap;

/// Speed of reference where nothing elastic holds the part, or it has no mass (m/s).
pub const WITHOUT_STATICS: f64 = 1.0;
/// Loads that cancel to less than this fraction of their sum act one by one.
const CANCELLED: f64 = 1e-3;
/// Contacts that get a shape of their own; the others share that of the last one.
const MAX_SHAPES: usize = 256;

impl System {
    /// Finds the reference speeds that the netlist does not give.
    pub fn settle_impacts(&mut self) {
        let open = |loss: Loss| loss.speed.is_none() && loss.restitution < 1.0;
        let mut asked: Vec<usize> =
            (0..self.members.len()).filter(|&g| self.members[g].loss().is_some_and(open)).collect();
        // combs last: shapes of their own are fewer than members
        asked.sort_by_key(|&g| self.members[g].side_room().is_some());
        if asked.is_empty() {
            return;
        }
        let mut bent = Bent::new(self);
        for group in groups(self, &asked) {
            let together = if group.len() > 1 { bent.frequency(self, &group) } else { None };
            let mut own = None;
            for &g in &group {
                let frequency = together.or_else(|| {
                    if bent.shapes < MAX_SHAPES || own.is_none() {
                        own = Some(bent.frequency(self, &[g]));
                    }
                    own.flatten()
                });
                let fall = self.members[g].add_closing(self.at(&bent.rest), &mut bent.unused);
                let speed = frequency.map_or(WITHOUT_STATICS, |frequency| frequency * fall);
                if let Some(loss) = self.members[g].loss() {
                    let speed = if speed > 0.0 { speed } else { WITHOUT_STATICS };
                    self.members[g].set_loss(loss.at(speed));
                }
            }
        }
    }
}

/// Contacts whose voltage is the same; others alone.
fn groups(system: &System, asked: &[usize]) -> Vec<Vec<usize>> {
    let rows = &system.electrics.gap_rows;
    let mut of_voltage: BTreeMap<Vec<u64>, usize> = BTreeMap::new();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for &g in asked {
        let row: Vec<u64> =
            if g < rows.nrows() { rows.row(g).iter().map(|x| x.to_bits()).collect() } else { Vec::new() };
        let fingers = system.members[g].side_room().is_some();
        let driven = !fingers && g < rows.nrows() && rows.row(g).iter().any(|x| *x != 0.0);
        match of_voltage.get(&row).filter(|_| driven) {
            Some(&group) => groups[group].push(g),
            None => {
                of_voltage.insert(row, groups.len());
                groups.push(vec![g]);
            }
        }
    }
    groups
}

/// Shapes that loads bend the drawn mechanism into.
struct Bent {
    /// The factored stiffness as drawn; none where a part can move freely.
    stiffness: Option<BodyMatrix>,
    rest: Vec<Pose>,
    unused: Vec<Pose>,
    shapes: usize,
}

impl Bent {
    fn new(system: &System) -> Self {
        let model = &system.model;
        let rest = vec![Pose::zeros(); system.bodies()];
        let mut unused = rest.clone();
        let mut stiffness = BodyMatrix::new(&model.pattern);
        forces::add_tangent(model, &rest, &system.electrics.drive().rest(), &mut stiffness, &mut unused);
        model.project_matrix(&mut stiffness);
        let stiffness = stiffness.factor(&model.pattern).is_ok().then_some(stiffness);
        Self { stiffness, rest, unused, shapes: 0 }
    }

    /// ω₀ (rad/s) of the shape into which contacts bend the mechanism together; `None` where they cancel or there is no
    /// contact.
    fn frequency(&mut self, system: &System, contacts: &[usize]) -> Option<f64> {
        let stiffness = self.stiffness.as_ref()?;
        let at = Configuration { q: &self.rest, linear: system.model.linear };
        self.shapes += 1;
        let (mut load, mut all) = (self.rest.clone(), 0.0);
        for &g in contacts {
            let mut own = self.rest.clone();
            system.members[g].add_closing(at, &mut own);
            system.model.project(&mut own);
            all += dot(&own, &own).sqrt();
            load.iter_mut().zip(&own).for_each(|(load, own)| *load += own);
        }
        if dot(&load, &load).sqrt() <= CANCELLED * all {
            return None;
        }
        let mut shape = load.clone();
        stiffness.solve(&system.model.pattern, &mut shape);
        let square = dot(&load, &shape) / system.model.mass_product(&shape, &shape);
        (square.is_finite() && square > 0.0).then(|| square.sqrt())
    }
}

fn dot(x: &[Pose], y: &[Pose]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x.dot(y)).sum()
}
