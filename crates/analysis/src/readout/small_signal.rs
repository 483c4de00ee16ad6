//! How a small change at one source that goes as e^(st) moves a state, and what is seen of it.
//!
//! [`PerturbedState`] is the physics at any complex s (rad/s): the effect of a unit input on the forces, and on the
//! quantities read from the motion that follows. A device asks at s = iω, an analysis of responses at poles and zeros,
//! too.

use super::signal::{Signal, SignalView};
use bimorph_domains::{Drive, System};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::planar::Pose;
use bimorph_solve::harmonic::ComplexPose;
use bimorph_solve::time::gyration::{held_out, skew};
use nalgebra::Complex;

/// A state and what holds it there.
#[derive(Debug, Clone, Copy)]
pub struct PerturbedState<'a> {
    /// The model.
    pub compiled: &'a CompiledModel,
    /// The model with the inputs among its sources.
    pub system: &'a System,
    /// Displacements in elimination order ((m), (rad)).
    pub q: &'a [Pose],
    /// Rates.
    pub v: &'a [Pose],
    /// Temperature rise of each heater (K).
    pub rise: &'a [f64],
    /// Values of the sources.
    pub sources: &'a [f64],
    /// Voltages, temperatures and loads.
    pub drive: &'a Drive,
}

/// Effect of a unit input at one source on the forces, without motion.
#[derive(Debug, Clone)]
pub struct SourceExcitation {
    /// Force on each body (N, N·m).
    pub force: Vec<ComplexPose>,
    /// Change of the voltage of each gap (V).
    pub(crate) volts: Vec<f64>,
    /// Change of the rise of each heater (K).
    pub(crate) rise: Vec<Complex<f64>>,
    /// Change of the current through resistances into each port (A).
    pub currents: Vec<Complex<f64>>,
}

/// How a part of a push depends on s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum FrequencyDependence {
    /// Not at all.
    AtOnce,
    /// As 1/(1 + sτ), τ in seconds.
    Lagged(f64),
    /// As s.
    Rate,
}

impl FrequencyDependence {
    /// The factor at s (rad/s).
    pub(crate) fn factor(self, s: Complex<f64>) -> Complex<f64> {
        match self {
            Self::AtOnce => Complex::from(1.0),
            Self::Lagged(tau) => (Complex::from(1.0) + s * tau).inv(),
            Self::Rate => s,
        }
    }
}

/// A part of a push.
#[derive(Debug, Clone)]
pub(crate) struct Constituent {
    /// How it depends on s.
    pub(crate) law: FrequencyDependence,
    /// Force on each body for a factor of 1 (N, N·m).
    pub(crate) force: Vec<Pose>,
    /// Change of the voltage of each gap (V).
    pub(crate) volts: Vec<f64>,
    /// Change of the rise of each heater (K).
    pub(crate) rise: Vec<f64>,
}

/// A motion of the bodies with what pushed them, in its real and imaginary parts.
#[derive(Debug, Clone)]
pub struct ForcedMotion {
    parts: [MotionComponent; 2],
}

#[derive(Debug, Clone)]
struct MotionComponent {
    q: Vec<Pose>,
    v: Vec<Pose>,
    rise: Vec<f64>,
    volts: Vec<f64>,
}

impl ForcedMotion {
    /// The motion `q` that goes as e^(st), with the push that it follows.
    pub fn new(push: &SourceExcitation, q: &[ComplexPose], s: Complex<f64>) -> Self {
        let part = |imaginary: bool| {
            let of = |c: Complex<f64>| if imaginary { c.im } else { c.re };
            // rates are s times displacements
            let rate = |c: Complex<f64>| {
                if imaginary { s.im * c.re + s.re * c.im } else { s.re * c.re - s.im * c.im }
            };
            MotionComponent {
                q: q.iter().map(|x| x.map(of)).collect(),
                v: q.iter().map(|x| x.map(rate)).collect(),
                rise: push.rise.iter().map(|r| of(*r)).collect(),
                volts: if imaginary { vec![0.0; push.volts.len()] } else { push.volts.clone() },
            }
        };
        Self { parts: [part(false), part(true)] }
    }
}

impl ForcedMotion {
    /// A real motion `q` that does not change, with these voltages and rises.
    pub(crate) fn held(q: Vec<Pose>, volts: Vec<f64>, rise: Vec<f64>) -> Self {
        let v = vec![Pose::zeros(); q.len()];
        let none =
            MotionComponent { q: v.clone(), v: v.clone(), rise: vec![0.0; rise.len()], volts: vec![0.0; volts.len()] };
        Self { parts: [MotionComponent { q, v, rise, volts }, none] }
    }
}

impl PerturbedState<'_> {
    fn view(&self) -> SignalView<'_> {
        SignalView { q: self.q, v: self.v, rise: self.rise, volts: &self.drive.volts }
    }

    /// The effect of a unit input e^(st) at source `source`.
    pub fn push(&self, source: usize, s: Complex<f64>) -> SourceExcitation {
        let system = self.system;
        let electrics = &system.electrics;
        let heaters = &electrics.heating.heaters;
        let mut unit = vec![0.0; electrics.sources()];
        unit[source] = 1.0;
        // heaters lag: δT = (2Qu·δV + Z·δW)/(1 + sτ)
        let rise: Vec<Complex<f64>> = match electrics.heating.is_hot() {
            true => electrics.heating.response((self.sources, self.rise), &unit, s),
            false => (0..heaters.len())
                .map(|k| {
                    let steady = electrics.heating.slope(k, self.sources, &unit);
                    Complex::from(steady) / (Complex::from(1.0) + s * heaters[k].time_constant)
                })
                .collect(),
        };
        let currents = self.currents(source, &unit, &rise);
        let volts: Vec<f64> = (0..self.drive.volts.len()).map(|g| electrics.gap_rows[(g, source)]).collect();
        let turns = system.is_rate(source);
        let [re, im] = [false, true].map(|imaginary| {
            let mut change = electrics.drive();
            let part: Vec<f64> = rise.iter().map(|rise| if imaginary { rise.im } else { rise.re }).collect();
            electrics.expand(&part, &mut change.expansion);
            change.load = 0.0;
            if !imaginary {
                change.volts.copy_from_slice(&volts);
                change.inputs.copy_from_slice(&unit[electrics.voltages()..]);
            }
            if turns {
                // the rate of the frame changes by s for each unit of it
                change.turning = if imaginary { s.im } else { s.re };
            }
            let mut force = vec![Pose::zeros(); system.bodies()];
            system.drive_force(self.q, self.drive, &change, &mut force);
            if turns && !imaginary {
                // Coriolis' force of the motion that the state has
                for ((force, body), v) in force.iter_mut().zip(&system.model.bodies).zip(self.v) {
                    *force += held_out(body, skew(body, 2.0, v));
                }
            }
            force
        });
        let force = re.iter().zip(&im).map(|(re, im)| re.zip_map(im, |re, im| Complex::new(-re, -im))).collect();
        SourceExcitation { force, volts, rise, currents }
    }

    /// Change of the current through resistances into each port for a unit of source `source`, with rises that change by `rise`.
    fn currents(&self, source: usize, unit: &[f64], rise: &[Complex<f64>]) -> Vec<Complex<f64>> {
        let electrics = &self.system.electrics;
        if !electrics.heating.is_hot() {
            return electrics.conductance.column(source).iter().map(|g| Complex::from(*g)).collect();
        }
        let about = (self.sources, self.rise);
        let (re, im): (Vec<f64>, Vec<f64>) = rise.iter().map(|rise| (rise.re, rise.im)).unzip();
        let [re, im] = [(unit.to_vec(), re), (vec![0.0; unit.len()], im)]
            .map(|(unit, slopes)| electrics.port_current_slopes(about, &unit, &slopes));
        re.into_iter().zip(im).map(|(re, im)| Complex::new(re, im)).collect()
    }

    /// [`PerturbedState::push`] in parts that do not depend on s: its sum over them, each times [`FrequencyDependence::factor`].
    pub(crate) fn constituents(&self, source: usize) -> Vec<Constituent> {
        let system = self.system;
        let electrics = &system.electrics;
        let heaters = &electrics.heating.heaters;
        let mut unit = vec![0.0; electrics.sources()];
        unit[source] = 1.0;
        let mut slopes = vec![0.0; electrics.heating.means()];
        electrics.heating.slopes(self.sources, self.rise, &unit, &mut slopes);
        // many time constants where resistances depend on temperature: the slowest is the nearest pole
        let slowest = electrics.heating.slowest(self.sources, self.rise);
        let law = |k: usize| match slowest.unwrap_or_else(|| heaters[k].time_constant) {
            tau if tau > 0.0 => FrequencyDependence::Lagged(tau),
            _ => FrequencyDependence::AtOnce,
        };
        let mut laws = vec![FrequencyDependence::AtOnce];
        for (k, slope) in slopes.iter().enumerate() {
            if *slope != 0.0 && !laws.contains(&law(k)) {
                laws.push(law(k));
            }
        }
        if system.is_rate(source) {
            laws.push(FrequencyDependence::Rate);
        }
        let one = |own: FrequencyDependence| {
            let rise: Vec<f64> = (0..slopes.len()).map(|k| if law(k) == own { slopes[k] } else { 0.0 }).collect();
            let mut change = electrics.drive();
            change.load = 0.0;
            electrics.expand(&rise, &mut change.expansion);
            if own == FrequencyDependence::AtOnce {
                for (g, volts) in change.volts.iter_mut().enumerate() {
                    *volts = electrics.gap_rows[(g, source)];
                }
                change.inputs.copy_from_slice(&unit[electrics.voltages()..]);
            }
            if own == FrequencyDependence::Rate {
                change.turning = 1.0;
            }
            let volts = change.volts.clone();
            let mut force = vec![Pose::zeros(); system.bodies()];
            system.drive_force(self.q, self.drive, &change, &mut force);
            if own == FrequencyDependence::AtOnce && system.is_rate(source) {
                for ((force, body), v) in force.iter_mut().zip(&system.model.bodies).zip(self.v) {
                    *force += held_out(body, skew(body, 2.0, v));
                }
            }
            force.iter_mut().for_each(|f| *f = -*f);
            Constituent { law: own, force, volts, rise }
        };
        laws.into_iter().map(one).collect()
    }

    /// Change of a signal.
    pub fn signal_change(&self, signal: Signal, moved: &ForcedMotion) -> Complex<f64> {
        let [re, im] = moved.parts.each_ref().map(|part| {
            let change = SignalView { q: &part.q, v: &part.v, rise: &part.rise, volts: &part.volts };
            signal.slope(self.compiled, &self.view(), &change)
        });
        Complex::new(re, im)
    }

    /// Change of the charge that each source has brought (C).
    pub fn charges(&self, sources: &[usize], moved: &ForcedMotion) -> Vec<Complex<f64>> {
        let mut charges = vec![Complex::from(0.0); sources.len()];
        for g in 0..self.drive.volts.len() {
            let [re, im] = moved
                .parts
                .each_ref()
                .map(|part| self.system.charge_slope(g, (self.q, &self.drive.volts), (&part.q, Some(&part.volts))));
            for (charge, &source) in charges.iter_mut().zip(sources) {
                let row = self.system.electrics.gap_rows[(g, source)];
                *charge += Complex::new(row * re, row * im);
            }
        }
        charges
    }

    /// Change of the rise of a heater (K).
    pub fn warmed(push: &SourceExcitation, heater: usize) -> Complex<f64> {
        push.rise[heater]
    }
}
