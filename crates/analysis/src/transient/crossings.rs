//! Crossings of levels within the steps of a run: the requested ones, and the contact of every gap that has one.

use super::super::AnalysisError;
use super::options::{TransientOptions, Until};
use super::result::CrossingEvent;
use crate::readout::ReadoutError;
use crate::readout::expression::Expression;
use crate::readout::run_signal::RunSignal;
use crate::readout::signal::{Signal, SignalView};
use bimorph_domains::contact_ways::ContactWays;
use bimorph_domains::{Domain, Ramp};
use bimorph_model::compile::CompiledModel;
use bimorph_solve::dense::interpolate;
use bimorph_solve::time::event::{Detector, Direction};
use bimorph_solve::time::method::Motion;

/// A signal whose crossings of a level are found.
struct WatchedSignal {
    name: String,
    signal: Expression<RunSignal>,
    level: f64,
    contact: bool,
    detector: Detector,
}

/// The requested crossings, and the contact of every gap that has one.
fn watched(
    compiled: &CompiledModel,
    options: &TransientOptions<'_>,
    sources: &[f64],
) -> Result<Vec<WatchedSignal>, AnalysisError> {
    let watch = |name: String, signal, level, contact| WatchedSignal {
        name,
        signal,
        level,
        contact,
        detector: Detector::default(),
    };
    let asked = options.events.iter().map(|(name, level)| {
        Expression::of_run(compiled, name, sources).map(|signal| watch(name.clone(), signal, *level, false))
    });
    let system = &compiled.parts.system;
    let ending = match &options.until {
        Some(Until::Level(name, level)) if !options.events.contains(&(name.clone(), *level)) => {
            Some(Expression::of_run(compiled, name, sources).map(|signal| watch(name.clone(), signal, *level, false)))
        }
        _ => None,
    };
    let touching =
        (0..system.members.len()).filter_map(|g| system.touching(g).map(|[touch, _]| (g, touch))).map(|(g, touch)| {
            let name = format!("{}.gap", compiled.parts.gap_names[g]);
            Ok(watch(name, RunSignal::State(Signal::Distance(g)).into(), touch, true))
        });
    let sides = (0..system.members.len()).filter(|&g| system.members[g].side_room().is_some()).map(|g| {
        let name = format!("{}.side", compiled.parts.gap_names[g]);
        Ok(watch(name, RunSignal::SideWay(g).into(), 0.0, true))
    });
    Ok(asked.chain(ending).chain(touching).chain(sides).collect::<Result<_, ReadoutError>>()?)
}

/// True for the event that ends a run.
fn ends(until: &Until, event: &CrossingEvent) -> bool {
    match until {
        Until::Contact => event.contact && event.direction == Direction::Down,
        Until::Release => event.contact && event.direction == Direction::Up,
        Until::Level(name, level) => !event.contact && event.signal == *name && event.level == *level,
    }
}

/// Finds the crossings of a run.
pub(super) struct Crossings<'a> {
    compiled: &'a CompiledModel,
    ramp: &'a Ramp<'a>,
    volts: &'a [f64],
    watched: Vec<WatchedSignal>,
    within: Motion,
    rise: Vec<f64>,
    until: Option<Until>,
    ways: ContactWays,
    /// Bound of the largest part of its way to contact that anything comes within the last step (1).
    nearest: f64,
    /// Events, in order of time.
    pub(super) events: Vec<CrossingEvent>,
}

impl<'a> Crossings<'a> {
    /// From the motion at the start, where the heaters are `rise` warmer (K), at the held voltages of sources and gaps (V).
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(super) fn start(
        (compiled, options): (&'a CompiledModel, &'a TransientOptions<'a>),
        (sources, (ramp, volts)): (&[f64], (&'a Ramp<'a>, &'a [f64])),
        (motion, rise): (&Motion, &[f64]),
    ) -> Result<Self, AnalysisError> {
        let mut watched = watched(compiled, options, sources)?;
        for w in &mut watched {
            let view = SignalView { q: &motion.q, v: &motion.v, rise, volts };
            w.detector = Detector::new(w.signal.value(compiled, &view) - w.level);
        }
        let within = Motion::zeros(compiled.parts.system.bodies());
        let until = options.until.clone();
        let ways = ContactWays::new(&compiled.parts.system);
        let (rise, events) = (rise.to_vec(), Vec::new());
        Ok(Self { compiled, ramp, volts, watched, within, rise, until, ways, nearest: f64::INFINITY, events })
    }

    /// True where nothing came further than a part of its way to contact (1) within the last step, by a bound.
    pub(super) fn stays_within(&self, part: f64) -> bool {
        self.nearest < part
    }

    /// Finds the crossings in a step of length `h` from time `s`, up to one that ends the run. Returns the time of that (s).
    pub(super) fn step(&mut self, s: f64, h: f64, before: &Motion, after: &Motion) -> Option<f64> {
        let (compiled, ramp, volts) = (self.compiled, self.ramp, self.volts);
        let first = self.events.len();
        let step = [(&before.q[..], &before.v[..]), (&after.q[..], &after.v[..])];
        self.nearest = self.ways.used(&compiled.parts.system, step, h);
        let stays = self.stays_within(1.0);
        for w in &mut self.watched {
            if w.contact && stays && w.detector.is_above() {
                continue;
            }
            let value = |x: f64| {
                interpolate(before, after, h, x, &mut self.within);
                for (k, r) in self.rise.iter_mut().enumerate() {
                    *r = ramp.rise_at(k, s + x * h);
                }
                let view = SignalView { q: &self.within.q, v: &self.within.v, rise: &self.rise, volts };
                w.signal.value(compiled, &view) - w.level
            };
            w.detector.step(value, |x, direction| {
                bimorph_base::budget::lay_out(size_of::<CrossingEvent>() + w.name.len());
                self.events.push(CrossingEvent {
                    signal: w.name.clone(),
                    level: w.level,
                    t: s + x * h,
                    direction,
                    contact: w.contact,
                });
            });
        }
        self.events[first..].sort_by(|a, b| a.t.total_cmp(&b.t));
        let until = self.until.as_ref()?;
        let last = first + self.events[first..].iter().position(|event| ends(until, event))?;
        self.events.truncate(last + 1);
        Some(self.events[last].t)
    }
}
