//! Conduction of heat between nodes and to those at ambient: mean rises of beams, and how long they lag behind the heat.
//!
//! Where a beam has a heat capacity, its time constant is the mean delay of its temperature rise behind the heat of all
//! beams in its thermal network. This is the first moment of its step response (Elmore, "The transient response of
//! damped linear networks", J. Appl. Phys. 19 (1948)): with θ the steady rise along the beams, the rise that the heat
//! C·θ would bring over θ. Along one beam of the capacity C that is, end temperatures θ_a and θ_b, in closed form
//! ```text
//! mean rise                 φ̄   = (φ_a + φ_b)/2 + C/K·((θ_a + θ_b)/24 + P/(120·K))
//! heat into the node at a   C·(θ_a/3 + θ_b/6 + P/(24·K))
//! ```
//! and C/(10·K) = ρ·c·l²/(10·k) between two anchors. A beam that loses heat through gas has the functions of `fin.rs` in their place, and
//! C times minus their slopes with the conductance to the sides: the heat that is stored acts as a conductance s·C there.

use super::fin::Fin;
use super::heat_curves::HeatCurves;
use super::laplacian::Laplacian;
use bimorph_base::sets::Sets;
use std::sync::Arc;
use thiserror::Error;

/// A conductor of heat and current between two nodes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeatConductor {
    /// First node.
    pub a: usize,
    /// Second node.
    pub b: usize,
    /// Electrical resistance (Ω).
    pub resistance: f64,
    /// Thermal conductance from end to end (W/K).
    pub conductance: f64,
    /// Thermal expansion coefficient (1/K).
    pub expansion: f64,
    /// Temperature at which it is as drawn (K).
    pub ambient: f64,
    /// Time constant (s); 0: at once.
    pub time_constant: f64,
    /// Whether that is to come of the heat capacities of all that conducts.
    pub delayed: bool,
    /// Heat capacity (J/K); 0 where it is not known.
    pub capacity: f64,
    /// Thermal conductance of all of its length through gas to the surroundings (W/K).
    pub gas: f64,
    /// Relative change of its resistivity with the rise (1/K).
    pub coefficient: f64,
    /// Relative change of its thermal resistivity with the rise (1/K).
    pub thermal_coefficient: f64,
    /// Relative change of its heat capacity with the rise (1/K).
    pub capacity_coefficient: f64,
    /// Power that it radiates, over the fourth power of its temperature (W/K⁴).
    pub radiation: f64,
    /// Rise above ambient of the substrate to which the gas conducts (K).
    pub substrate: f64,
    /// Properties that have curves over temperature; none: no one has.
    pub curves: Option<Arc<HeatCurves>>,
}

impl HeatConductor {
    /// Whether any of its properties depends on temperature, or its substrate is not at ambient: it takes the network of [`super::hot`].
    pub fn depends_on_temperature(&self) -> bool {
        let laws =
            [self.coefficient, self.thermal_coefficient, self.capacity_coefficient, self.radiation, self.substrate];
        laws.iter().any(|x| *x != 0.0) || self.curves.is_some()
    }

    /// Whether its resistance depends on temperature.
    pub fn changes_resistance(&self) -> bool {
        self.coefficient != 0.0 || self.curves.as_ref().is_some_and(|curves| curves.resistance.is_some())
    }

    /// Its heat capacity, or that with which it alone between cold ends has the given time constant (J/K).
    pub(super) fn stored(&self) -> f64 {
        if self.delayed {
            return self.capacity;
        }
        let fin = Fin::new(self.conductance, self.gas);
        -self.time_constant * fin.own / fin.slopes(self.conductance).own
    }
}

/// A heated beam whose heat cannot leave: nothing conducts from it to an anchor.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("heater {heater} is not connected to any anchor through heat conductors")]
pub struct NoHeatSink {
    /// Index of a heater in that part.
    pub heater: usize,
}

/// Conduction of heat between nodes and to those at ambient.
pub(super) struct Conduction {
    /// Row of each node; none for one at ambient.
    row: Vec<Option<usize>>,
    free: usize,
    laplacian: Laplacian,
    /// Heater by heater, what its length does to the heat in it.
    fins: Vec<Fin>,
}

impl Conduction {
    /// # Errors
    /// [`NoHeatSink`].
    pub(super) fn new(heaters: &[HeatConductor], sink: &[bool]) -> Result<Self, NoHeatSink> {
        let mut row = vec![None; sink.len()];
        let mut free = 0;
        for h in heaters {
            for node in [h.a, h.b] {
                if !sink[node] && row[node].is_none() {
                    row[node] = Some(free);
                    free += 1;
                }
            }
        }
        if let Some(heater) = without_sink(heaters, sink) {
            return Err(NoHeatSink { heater });
        }
        let fins: Vec<Fin> = heaters.iter().map(|h| Fin::new(h.conductance, h.gas)).collect();
        let conductors = heaters.iter().zip(&fins).map(|(h, fin)| (row[h.a], row[h.b], fin.through));
        // what leaves through gas, at each of the two ends
        let aside = heaters.iter().zip(&fins).filter(|(_, fin)| fin.aside > 0.0);
        let aside = aside.flat_map(|(h, fin)| [(row[h.a], None, fin.aside), (row[h.b], None, fin.aside)]);
        let laplacian = Laplacian::new(free, conductors.chain(aside)).ok_or(NoHeatSink { heater: 0 })?;
        Ok(Self { row, free, laplacian, fins })
    }

    /// Mean rise of each heater for the heat into each (K, W).
    pub(super) fn rises(&self, heaters: &[HeatConductor], watts: &[f64]) -> Vec<f64> {
        let ends = self.ends(heaters, self.outflows(watts));
        let each = heaters.iter().zip(&self.fins).zip(watts).zip(ends);
        each.map(|(((h, fin), watts), ends)| mean(h, fin, *watts, ends)).collect()
    }

    /// Highest rise along each heater for the heat into each (K, W).
    pub(super) fn peaks(&self, heaters: &[HeatConductor], watts: &[f64]) -> Vec<f64> {
        let ends = self.ends(heaters, self.outflows(watts));
        let each = heaters.iter().zip(&self.fins).zip(watts).zip(ends);
        each.map(|(((h, fin), watts), ends)| fin.peak(h.conductance, *watts, ends)).collect()
    }

    /// Heat from each heater into both of its ends while those are at ambient (W).
    fn outflows<'a>(&'a self, watts: &'a [f64]) -> impl Iterator<Item = [f64; 2]> + 'a {
        self.fins.iter().zip(watts).map(|(fin, watts)| [0.5 * watts * fin.share; 2])
    }

    /// Rise at both ends of each heater for the heat from it into both (K, W).
    fn ends(&self, heaters: &[HeatConductor], into: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
        let mut rise = vec![0.0; self.free];
        for (h, watts) in heaters.iter().zip(into) {
            for (row, watts) in [self.row[h.a], self.row[h.b]].into_iter().zip(watts) {
                if let Some(row) = row {
                    rise[row] += watts;
                }
            }
        }
        self.laplacian.solve(&mut rise);
        let at = |node: usize| self.row[node].map_or(0.0, |row| rise[row]);
        heaters.iter().map(|h| [at(h.a), at(h.b)]).collect()
    }

    /// The heat into each heater, and where none comes into a part that conducts together, heat in proportion to capacity (W). The nodes
    /// of a heater that are not at ambient join it to a part.
    fn evenly(&self, heaters: &[HeatConductor], watts: &[f64]) -> Vec<f64> {
        let count = self.row.len();
        let mut parts = Sets::new(count + heaters.len());
        for (k, h) in heaters.iter().enumerate() {
            for node in [h.a, h.b] {
                if self.row[node].is_some() {
                    parts.join(node, count + k);
                }
            }
        }
        let mut heated = vec![false; count + heaters.len()];
        for (k, watts) in watts.iter().enumerate() {
            heated[parts.first(count + k)] |= *watts > 0.0;
        }
        let one = |(k, (h, watts)): (usize, (&HeatConductor, &f64))| {
            if heated[parts.first(count + k)] { *watts } else { h.capacity }
        };
        heaters.iter().zip(watts).enumerate().map(one).collect()
    }

    /// Mean delay of the rise of each heater behind the heat into all of them (s, W). A part that none comes into is heated evenly.
    pub(super) fn delays(&self, heaters: &[HeatConductor], watts: &[f64]) -> Vec<f64> {
        let watts = &self.evenly(heaters, watts);
        let warm = self.ends(heaters, self.outflows(watts));
        let stored =
            |(((h, fin), watts), ends): (((&HeatConductor, &Fin), &f64), &[f64; 2])| stored(h, fin, *watts, *ends);
        let late = self.ends(heaters, heaters.iter().zip(&self.fins).zip(watts).zip(&warm).map(stored));
        let one = |((h, fin), watts): ((&HeatConductor, &Fin), &f64), warm: [f64; 2], late: [f64; 2]| {
            let rise = mean(h, fin, *watts, warm);
            let delayed = 0.5 * (late[0] + late[1]) * fin.share + delayed_mean(h, fin, *watts, warm);
            if rise > 0.0 { delayed / rise } else { h.capacity / h.conductance / 10.0 }
        };
        let ends = warm.into_iter().zip(late);
        let each = heaters.iter().zip(&self.fins).zip(watts).zip(ends);
        each.map(|(heated, (warm, late))| one(heated, warm, late)).collect()
    }
}

/// Mean rise of a heater between its ends (K).
fn mean(h: &HeatConductor, fin: &Fin, watts: f64, ends: [f64; 2]) -> f64 {
    if h.gas == 0.0 {
        return 0.5 * (ends[0] + ends[1]) + watts / (12.0 * h.conductance);
    }
    0.5 * (ends[0] + ends[1]) * fin.share + watts * fin.own
}

/// Heat over time by which a heater's flows into its ends are late (W·s), at the steady rise of its ends.
fn stored(h: &HeatConductor, fin: &Fin, watts: f64, [a, b]: [f64; 2]) -> [f64; 2] {
    if h.gas == 0.0 {
        let own = watts / (24.0 * h.conductance);
        return [h.capacity * (a / 3.0 + b / 6.0 + own), h.capacity * (a / 6.0 + b / 3.0 + own)];
    }
    let slope = fin.slopes(h.conductance);
    let flow = |near: f64, far: f64| slope.aside * near + slope.through * (near - far) - 0.5 * watts * slope.share;
    [h.capacity * flow(a, b), h.capacity * flow(b, a)]
}

/// Rise over time by which a heater's mean rise is late between ends that are not (K·s).
fn delayed_mean(h: &HeatConductor, fin: &Fin, watts: f64, [a, b]: [f64; 2]) -> f64 {
    if h.gas == 0.0 {
        return h.capacity / h.conductance * ((a + b) / 24.0 + watts / (120.0 * h.conductance));
    }
    let slope = fin.slopes(h.conductance);
    -h.capacity * (0.5 * (a + b) * slope.share + watts * slope.own)
}

/// A heater of a part that holds no sink.
fn without_sink(heaters: &[HeatConductor], sink: &[bool]) -> Option<usize> {
    let mut parts = Sets::new(sink.len());
    for h in heaters {
        parts.join(h.a, h.b);
    }
    let mut cooled = vec![false; sink.len()];
    let by_gas = heaters.iter().filter(|h| h.gas > 0.0).map(|h| h.a);
    (0..sink.len()).filter(|node| sink[*node]).chain(by_gas).for_each(|node| cooled[parts.first(node)] = true);
    heaters.iter().position(|h| !cooled[parts.first(h.a)])
}
