//! The bank of the paper: thermal bimorphs in a row whose tips push a yoke, as rods and pins with springs.
//!
//! A bimorph has twelve pins. Five are along the hot arm (four rods between its anchor and the bar at its tip), and
//! four along the cold arm (a wide rod, then a flexure of two rods to its anchor). Two are at the link to the yoke and
//! one is in the yoke. Ten of them are coordinates, two close loops; as drawn, both arms are straight.

use super::mechanism::{Mechanism, PIN};
use bimorph::multibody::BodyId;

/// Length of an arm, distance of the two arms, distance of bimorphs (m).
const LENGTH: f64 = 200e-6;
const GAP: f64 = 10e-6;
const PITCH: f64 = 60e-6;
/// Density (kg/m³), thickness (m) and Young's modulus (Pa) of polysilicon.
const DENSITY: f64 = 2300.0;
const THICK: f64 = 2e-6;
const MODULUS: f64 = 165e9;
/// Coordinates of one bimorph.
pub(crate) const COORDINATES: usize = 10;

/// Bodies in the order of description, with the tree and the loops that the description implies.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bank {
    /// Bodies and joints.
    pub(crate) mechanism: Mechanism,
    /// Parents of each body, with the position of the pin (m).
    pub(crate) hangs: Vec<(BodyId, [f64; 2])>,
    /// Pins that close loops: two bodies and the place (m).
    pub(crate) closes: Vec<(BodyId, BodyId, [f64; 2])>,
    /// Centres of mass as drawn (m).
    pub(crate) centers: Vec<[f64; 2]>,
}

impl Bank {
    /// `count` bimorphs along y, arms along x.
    pub(crate) fn new(count: usize) -> Self {
        let mut bank = Self::default();
        let mut yoke = BodyId::Ground;
        for k in 0..count {
            let y = PITCH * k as f64;
            let mut up = BodyId::Ground;
            for s in 0..4 {
                let x = 0.25 * LENGTH * s as f64;
                up = bank.rod(up, [x, y], [x + 0.25 * LENGTH, y], 2e-6);
            }
            let tip = bank.rod(up, [LENGTH, y], [LENGTH, y - GAP], 6e-6);
            let wide = bank.rod(tip, [LENGTH, y - GAP], [0.2 * LENGTH, y - GAP], 8e-6);
            let flexure = bank.rod(wide, [0.2 * LENGTH, y - GAP], [0.1 * LENGTH, y - GAP], 2e-6);
            let foot = bank.rod(flexure, [0.1 * LENGTH, y - GAP], [0.0, y - GAP], 2e-6);
            bank.close(foot, BodyId::Ground, [0.0, y - GAP]);
            let at = [LENGTH + 20e-6, y];
            let link = bank.rod(tip, [LENGTH, y], at, 3e-6);
            let next = [at[0], y + PITCH];
            if k == 0 {
                yoke = bank.rod(link, at, next, 10e-6);
            } else {
                let part = bank.rod(yoke, at, next, 10e-6);
                bank.close(link, part, at);
                yoke = part;
            }
        }
        bank
    }

    fn rod(&mut self, up: BodyId, from: [f64; 2], to: [f64; 2], width: f64) -> BodyId {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let center = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
        let mass = DENSITY * THICK * width * length;
        let body = self.mechanism.body(center, mass, mass * (length * length + width * width) / 12.0);
        self.mechanism.join(up, body, from, 0.0, PIN, [0.0, 0.0, spring(width)]);
        self.hangs.push((up, from));
        self.centers.push(center);
        body
    }

    fn close(&mut self, a: BodyId, b: BodyId, at: [f64; 2]) {
        self.mechanism.join(a, b, at, 0.0, PIN, [0.0, 0.0, spring(2e-6)]);
        self.closes.push((a, b, at));
    }
}

/// EI/h of a pin (N·m/rad), h a tenth of an arm.
fn spring(width: f64) -> f64 {
    MODULUS * THICK * width.powi(3) / 12.0 / (0.1 * LENGTH)
}
