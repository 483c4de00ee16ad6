//! Inputs of a mechanism, each with its range: dead loads and built-in strains together, squared voltages across gaps, free
//! strains of heated beams, and mechanical inputs such as forces and accelerations.
//!
//! Forces at rest are linear in each of them. Parts that vary in proportion in a whole run count as one.

use bimorph_domains::{Drive, System};
use bimorph_multibody::planar::Pose;

/// Most inputs of a reduced model.
pub const MAX_INPUTS: usize = 12;
/// Deviation from proportion up to which two drives count as one (1).
const PROPORTIONAL: f64 = 1e-9;
/// Iterations for the golden ratio of d dimensions, the root of x^(d+1) = x + 1, each of which halves its error at least.
const RATIO_ITERATIONS: usize = 60;

/// One input: the drive of its unit, and its range.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainingInput {
    /// The drive at a value of 1; voltages follow the square root of the value.
    pub unit: Drive,
    /// Smallest and largest value (1).
    pub range: [f64; 2],
}

/// The inputs of a mechanism with their ranges.
#[derive(Debug, Clone, PartialEq)]
pub struct InputBox {
    /// The drive without any input.
    pub none: Drive,
    /// Inputs.
    pub inputs: Vec<TrainingInput>,
}

impl InputBox {
    /// The box around drives of one run. `overshoot` is how far the motion exceeds the statics of a drive: 1 for statics, 2 for a
    /// load that is applied at once; ranges begin at −1 of that where motions swing through rest.
    pub fn around(system: &System, drives: &[Drive], overshoot: [f64; 2]) -> Self {
        let none = Drive { load: 0.0, ..system.electrics.drive() };
        let mut inputs = Vec::new();
        let mut add = |unit: Drive| inputs.push(TrainingInput { unit, range: overshoot });
        let loaded = !system.loads.is_empty() || system.model.joints.iter().any(|joint| joint.rest != 0.0);
        let load = drives.iter().map(|drive| drive.load).fold(0.0, f64::max);
        if loaded && load != 0.0 {
            add(Drive { load, ..none.clone() });
        }
        for group in groups(none.volts.len(), |k| drives.iter().map(|drive| drive.volts[k].abs()).collect()) {
            let mut unit = none.clone();
            group.iter().for_each(|(k, largest)| unit.volts[*k] = *largest);
            add(unit);
        }
        for group in groups(none.expansion.len(), |k| drives.iter().map(|drive| drive.expansion[k]).collect()) {
            let mut unit = none.clone();
            group.iter().for_each(|(k, largest)| unit.expansion[*k] = *largest);
            add(unit);
        }
        for group in groups(none.inputs.len(), |k| drives.iter().map(|drive| drive.inputs[k]).collect()) {
            let mut unit = none.clone();
            group.iter().for_each(|(k, largest)| unit.inputs[*k] = *largest);
            add(unit);
        }
        Self { none, inputs }
    }

    /// Whether voltage is in this input, so that its value is a square.
    pub fn is_square(&self, input: usize) -> bool {
        self.inputs[input].unit.volts.iter().any(|v| *v != 0.0)
    }

    /// The drive at values `u` of the inputs; squares below 0 are taken as 0.
    pub fn drive(&self, u: &[f64]) -> Drive {
        let mut drive = self.none.clone();
        for (input, u) in self.inputs.iter().zip(u) {
            let root = u.max(0.0).sqrt();
            let unit = &input.unit;
            drive.load += unit.load * u;
            drive.volts.iter_mut().zip(&unit.volts).for_each(|(v, unit)| *v += unit * root);
            drive.expansion.iter_mut().zip(&unit.expansion).for_each(|(x, unit)| *x += unit * u);
            drive.inputs.iter_mut().zip(&unit.inputs).for_each(|(x, unit)| *x += unit * u);
        }
        drive
    }

    /// Force of a unit of one input on the bodies at rest, where `at_rest` is the residual without any input (N, N·m).
    pub fn force(&self, system: &System, input: usize, at_rest: &[Pose]) -> Vec<Pose> {
        let values: Vec<f64> = (0..self.inputs.len()).map(|k| if k == input { 1.0 } else { 0.0 }).collect();
        let rest = vec![Pose::zeros(); system.bodies()];
        let mut force = rest.clone();
        system.residual(&rest, &self.drive(&values), &mut force);
        force.iter_mut().zip(at_rest).for_each(|(force, at_rest)| *force = at_rest - *force);
        force
    }

    /// Corners of the box, where there are few inputs, and `count` points within, the same in every run. Values stay within −1 and 1, and
    /// squares at 0 or above, where `physical`.
    pub fn points(&self, count: usize, physical: bool) -> Vec<Vec<f64>> {
        let p = self.inputs.len();
        let range = |i: usize| {
            let [low, high] = self.inputs[i].range;
            match physical {
                true => [low.max(if self.is_square(i) { 0.0 } else { -1.0 }), high.min(1.0)],
                false => [low, high],
            }
        };
        let corners = if p <= 4 { 1usize << p } else { 0 };
        let corner = |c: usize| (0..p).map(|i| range(i)[(c >> i) & 1]).collect();
        let mut points: Vec<Vec<f64>> = (0..corners).map(corner).collect();
        if p > 4 {
            points.push((0..p).map(|i| range(i)[1]).collect());
            for i in 0..p {
                points.extend([0, 1].map(|end| (0..p).map(|k| if k == i { range(i)[end] } else { 0.0 }).collect()));
            }
        }
        points.extend(low_discrepancy(p, count).into_iter().map(|x| {
            let within = |(i, x): (usize, f64)| {
                let [low, high] = range(i);
                low + x * (high - low)
            };
            x.into_iter().enumerate().map(within).collect::<Vec<f64>>()
        }));
        points
    }
}

/// Members of a group, each with its value of largest magnitude.
type ProportionalGroup = Vec<(usize, f64)>;

/// Members that are not zero all along, in groups that vary in proportion; each member with its value of largest magnitude.
fn groups(count: usize, course: impl Fn(usize) -> Vec<f64>) -> Vec<ProportionalGroup> {
    let largest = |x: &[f64]| x.iter().fold(0.0f64, |most, x| if x.abs() > most.abs() { *x } else { most });
    let mut groups: Vec<(Vec<f64>, ProportionalGroup)> = Vec::new();
    for k in 0..count {
        let values = course(k);
        let most = largest(&values);
        if most == 0.0 {
            continue;
        }
        let scaled: Vec<f64> = values.iter().map(|x| x / most).collect();
        let like = |of: &[f64]| of.iter().zip(&scaled).all(|(a, b)| (a - b).abs() <= PROPORTIONAL);
        match groups.iter_mut().find(|(of, _)| like(of)) {
            Some((_, members)) => members.push((k, most)),
            None => groups.push((scaled, vec![(k, most)])),
        }
    }
    groups.into_iter().map(|(_, members)| members).collect()
}

/// Points of the unit cube that fill it evenly.
///
/// Reference: M. Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018): x_k = frac(k·(1/φ, 1/φ², …)).
pub(super) fn low_discrepancy(dimensions: usize, count: usize) -> Vec<Vec<f64>> {
    let mut phi = 2.0f64;
    for _ in 0..RATIO_ITERATIONS {
        phi = (1.0 + phi).powf(1.0 / (dimensions as f64 + 1.0));
    }
    let step: Vec<f64> = (1..=dimensions).map(|i| phi.powi(-(i as i32))).collect();
    (1..=count).map(|k| step.iter().map(|a| (0.5 + k as f64 * a).fract()).collect()).collect()
}
