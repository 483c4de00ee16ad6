//! The choice of `auto` against each formulation, on random mechanisms: `FIRST COUNT` of them, all 100 by default. With `formulations` before these no other
//! method runs.
//!
//!     taskset -c 0 cargo run --release --example formulation_choice > choice.csv
//!
//! Five kinds in turn: chains and trees of rigid plates on flexures, the same held at their end, trees of beams, and frames with loops. Every other one is
//! released from its deflection; the others start from rest under a load. Loads turn the last part by 0.003 to 0.8 rad. Runs last 0.5 to 4 periods of the
//! lowest mode, undamped, at tolerances of 1e-2 and 1e-3.
//!
//! Each run has a line. `steps` are accepted ones, and `all_steps` those of all runs with rejected ones. `whole_ms` is the time of the analysis with its
//! mesh, the least of some. `work` counts all runs: solves, forces and factorizations, weighted as `bimorph chart` does, times unknowns. Bodies also go by
//! other methods, which are given up after twenty times the time of the default one. `scripts/profiles` draws performance profiles. The error is the root mean
//! square of the worst signal, of its amplitude, from `auto` at a hundredth of the tolerance. That is no reference if it reports more than the tolerance, or no error. A refusal stands in place of the numbers. The summary goes to
//! standard error.

use bimorph::analysis::chart::passes;
use bimorph::analysis::chosen_run::{FittedRun, run_as_chosen};
use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::modes::modes;
use bimorph::analysis::statics::static_equilibrium;
use bimorph::analysis::step_error::with_step_error;
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{CompileOptions, CompiledModel, Formulation, compile};
use bimorph::netlist::{Bundle, Setting};
use std::f64::consts::TAU;
use std::fmt::Write;
use std::time::Instant;

const SCENES: usize = 100;
const TOLERANCES: [f64; 2] = [1e-2, 1e-3];
const KINDS: [&str; 5] = ["chain", "tree", "held", "branches", "frame"];
/// `rcr-elastic` is `rcr` with this method.
const FIXED: [Formulation; 3] = [Formulation::Compliant, Formulation::Rcr, Formulation::Reduced];
/// Other methods for bodies.
const METHODS: [Integrator; 2] = [Integrator::GeneralizedAlpha { rho: Integrator::RHO }, Integrator::Radau5];
/// Longest time of another method, relative to the default one.
const LONGEST: f64 = 20.0;
/// Tolerance from which on there are reduced models in time.
const REDUCED: f64 = 5e-3;
/// Work of `auto` relative to the best formulation that is accepted.
const MOST: f64 = 1.1;
/// Longest time of an analysis (s).
const PATIENCE: f64 = 20.0;
/// Shortest step (s).
const SHORTEST: f64 = 1e-15;

/// Numbers from a seed (SplitMix64; Steele, Lea and Flood, 2014).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn log(&mut self, low: f64, high: f64) -> f64 {
        self.within(low.ln(), high.ln()).exp()
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }
}

/// A signal: name, unit, samples.
type NamedSignal = (String, String, Vec<f64>);

/// A mechanism and its run.
struct Scene {
    text: String,
    force: f64,
    release: bool,
    stop: f64,
    signals: Vec<String>,
}

/// A run.
struct Done {
    result: TransientResult,
    /// Of the whole analysis, its mesh included (ms).
    whole: f64,
    /// Of all runs (ms).
    runs: f64,
    steps: u64,
    /// Of all runs, in passes over one unknown.
    work: f64,
    shortest: f64,
    segments: usize,
}

/// Formulation, method and tolerance of a run.
#[derive(Clone, Copy)]
struct Way {
    formulation: Formulation,
    method: Integrator,
    tol: f64,
    /// Longest time (s).
    patience: f64,
}

impl Way {
    /// By the default method.
    fn by(formulation: Formulation, tol: f64) -> Self {
        Self { formulation, method: Integrator::default(), tol, patience: PATIENCE }
    }
}

fn main() {
    let given: Vec<usize> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let methods = if std::env::args().any(|word| word == "formulations") { &[][..] } else { &METHODS[..] };
    let (first, count) = (given.first().copied().unwrap_or(0), given.get(1).copied().unwrap_or(SCENES));
    println!(
        "scene,kind,tol,formulation,took,error,reported,steps,all_steps,runs_ms,whole_ms,work,shortest_s,segments"
    );
    let mut counts = Summary::default();
    for number in first..first + count {
        let Some(scene) = scene(number) else {
            println!("{number},{},no equilibrium or no mode", KINDS[number % KINDS.len()]);
            continue;
        };
        TOLERANCES.iter().for_each(|tol| compare(number, &scene, (*tol, methods), &mut counts));
    }
    eprintln!("{counts:?}");
}

#[derive(Debug, Default)]
struct Summary {
    questions: usize,
    within_tolerance: usize,
    reported: usize,
    without_reference: usize,
    wrong: Vec<(usize, f64, f64)>,
    refused: Vec<(usize, f64, String)>,
    more_steps: Vec<(usize, f64, f64)>,
    more_time: Vec<(usize, f64, f64)>,
    short: Vec<(usize, f64, f64)>,
}

/// Every formulation on one mechanism at one tolerance, and bodies by other methods.
fn compare(number: usize, scene: &Scene, (tol, methods): (f64, &[Integrator]), counts: &mut Summary) {
    let reference = run(scene, Way::by(Formulation::Auto, tol / 100.0), 1);
    let reference = reference.ok().filter(|done| reported(&done.result) <= tol);
    let line = |name: &str, done: &Result<Done, String>| {
        print!("{number},{},{tol:e},{name},", KINDS[number % KINDS.len()]);
        match done {
            Ok(done) => {
                let took = done.result.formulation_taken.as_deref().unwrap_or(name);
                let took = took.split(':').next().unwrap_or_default();
                let error = reference.as_ref().map_or(f64::NAN, |best| error(&best.result, &done.result));
                println!(
                    "{took},{error:.2e},{:.2e},{},{},{:.2},{:.2},{:.3e},{:.1e},{}",
                    reported(&done.result),
                    done.result.counters.steps,
                    done.steps,
                    done.runs,
                    done.whole,
                    done.work,
                    done.shortest,
                    done.segments
                );
                error
            }
            Err(refusal) => {
                println!("{refusal:?}");
                f64::NAN
            }
        }
    };
    let auto = run(scene, Way::by(Formulation::Auto, tol), 3);
    let error = line("auto", &auto);
    let mut best: Option<(u64, f64)> = None;
    let mut accepted = 0;
    for formulation in FIXED.into_iter().filter(|f| *f != Formulation::Reduced || tol >= REDUCED) {
        let done = run(scene, Way::by(formulation, tol), 3);
        line(formulation.name(), &done);
        accepted += usize::from(done.is_ok());
        if formulation == Formulation::Compliant {
            let longest = done.as_ref().map_or(PATIENCE, |done| (LONGEST * 1e-3 * done.whole).min(PATIENCE));
            for &method in methods {
                let way = Way { method, patience: longest, ..Way::by(formulation, tol) };
                line(method.name(), &run(scene, way, 3));
            }
        }
        // one whose error is beyond the tolerance has not answered
        let holds = |done: &Done| reference.as_ref().is_none_or(|best| self::error(&best.result, &done.result) <= tol);
        if let Some(done) = done.ok().filter(holds) {
            let (steps, ms) = best.unwrap_or((u64::MAX, f64::INFINITY));
            best = Some((steps.min(done.steps), ms.min(done.whole)));
        }
    }
    counts.questions += 1;
    match (auto, best) {
        (Ok(auto), best) => {
            let (steps, ms) = best.unwrap_or((auto.steps, auto.whole));
            let reported = reported(&auto.result);
            counts.within_tolerance += usize::from(error <= tol);
            counts.reported += usize::from(error > tol && reported > tol);
            counts.without_reference += usize::from(error.is_nan());
            if error > tol && reported <= tol {
                counts.wrong.push((number, tol, error));
            }
            let (steps, ms) = (auto.steps as f64 / steps as f64, auto.whole / ms);
            if steps > MOST {
                counts.more_steps.push((number, tol, steps));
            }
            if ms > MOST {
                counts.more_time.push((number, tol, ms));
            }
            if auto.shortest < SHORTEST {
                counts.short.push((number, tol, auto.shortest));
            }
        }
        (Err(why), _) if accepted > 0 => counts.refused.push((number, tol, why)),
        _ => counts.questions -= 1,
    }
}

/// The error that a result reports: the larger of those of mesh and steps; infinite without one of them.
fn reported(result: &TransientResult) -> f64 {
    let or = |error: Option<f64>| error.unwrap_or(f64::INFINITY);
    or(result.estimated_error).max(or(result.step_error))
}

/// The error of the worst signal, of its amplitude or of a thirtieth of the largest.
fn error(reference: &TransientResult, found: &TransientResult) -> f64 {
    let amplitude = |values: &[f64]| {
        let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
        0.5 * (high - low)
    };
    let largest = reference.signals.iter().map(|s| amplitude(&s.2)).fold(0.0, f64::max);
    let of_signal = |(want, got): (&NamedSignal, &NamedSignal)| {
        let squares: f64 = want.2.iter().zip(&got.2).map(|(a, b)| (a - b) * (a - b)).sum();
        (squares / want.2.len() as f64).sqrt() / amplitude(&want.2).max(largest / 30.0)
    };
    reference.signals.iter().zip(&found.signals).map(of_signal).fold(0.0, f64::max)
}

/// The analysis of a front end, `times` times.
fn run(scene: &Scene, way: Way, times: usize) -> Result<Done, String> {
    let mut best: Option<Done> = None;
    let begun = Instant::now();
    for _ in 0..times {
        let done = once(scene, way)?;
        let (whole, runs) = best.as_ref().map_or((f64::INFINITY, f64::INFINITY), |best| (best.whole, best.runs));
        let long = begun.elapsed().as_secs_f64() > 0.1;
        best = Some(Done { whole: done.whole.min(whole), runs: done.runs.min(runs), ..done });
        if long {
            break;
        }
    }
    best.ok_or_else(String::new)
}

fn ms(begin: Instant, end: Instant) -> f64 {
    1e3 * (end - begin).as_secs_f64()
}

fn once(scene: &Scene, Way { formulation, method, tol, patience }: Way) -> Result<Done, String> {
    let options = CompileOptions { tol, formulation, undamped: true, ..CompileOptions::default() };
    let begin = Instant::now();
    let moving = scene.compiled(&options, if scene.release { 0.0 } else { scene.force })?;
    let held = scene.release.then(|| scene.compiled(&options, scene.force)).transpose()?;
    let options = TransientOptions {
        stop: scene.stop,
        signals: scene.signals.clone(),
        points: 101,
        tol,
        release: held.as_ref(),
        method,
        ..TransientOptions::default()
    };
    let (mut shortest, mut steps, mut work, mut segments, mut runs) = (f64::INFINITY, 0, 0.0, 0, 0.0);
    let mut attempt = |fitted: FittedRun, sample: &mut dyn FnMut(f64, &[f64]), watch: &mut dyn FnMut(f64) -> bool| {
        let meshed = Instant::now();
        segments = fitted.moving.order.segments.iter().copied().max().unwrap_or(0);
        let options = options.with_release(fitted.start.as_ref());
        let mut go = |options: &TransientOptions<'_>,
                      sample: &mut dyn FnMut(f64, &[f64]),
                      watch: &mut dyn FnMut(f64) -> bool| {
            let mut before = 0.0;
            let mut see = |fraction: f64| {
                shortest = f64::min(shortest, (fraction - before) * options.stop);
                before = fraction;
                watch(fraction) && begin.elapsed().as_secs_f64() < patience
            };
            let result = transient(&fitted.moving, options, sample, &mut see)?;
            steps += result.counters.steps + result.counters.rejected;
            let c = result.counters;
            work += passes(c.factorizations, c.solves, c.forces) * result.unknowns as f64;
            Ok((result, ()))
        };
        let done = with_step_error(&options, &fitted.moving, &mut go, sample, watch);
        runs += ms(meshed, Instant::now());
        done
    };
    let found = run_as_chosen(&moving, &options, &mut attempt, &mut |_, _| (), &mut |_| true);
    let (result, ()) = found.map_err(|e| e.to_string())?;
    Ok(Done { result, whole: ms(begin, Instant::now()), runs, steps, work, shortest, segments })
}

impl Scene {
    fn compiled(&self, options: &CompileOptions, force: f64) -> Result<CompiledModel, String> {
        let set = vec![("F".to_owned(), Setting::Number(force))];
        let options = CompileOptions { set, ..options.clone() };
        compile(&Bundle::from_text("scene.net", &self.text), &options).map_err(|e| e.to_string())
    }
}

/// The mechanism of a number; none where it has no equilibrium under a small load.
fn scene(number: usize) -> Option<Scene> {
    let mut draw = Numbers(number as u64);
    let thickness = draw.log(1e-6, 10e-6);
    let mut text = format!("process p1 = [Youngsmodulus=165e9 density=2300 h={thickness:e}]\nparam F=1u\n");
    let end = match KINDS[number % KINDS.len()] {
        "chain" => plates(&mut draw, &mut text, false, false),
        "tree" => plates(&mut draw, &mut text, true, false),
        "held" => plates(&mut draw, &mut text, false, true),
        "branches" => beams(&mut draw, &mut text, 0),
        _ => {
            let loops = 1 + draw.below(3);
            beams(&mut draw, &mut text, loops)
        }
    };
    let _ = writeln!(text, "f2d * [{end}] [F=F oz={:e}]", draw.within(0.0, TAU));
    let target = draw.log(3e-3, 0.8);
    let periods = draw.within(0.5, 4.0);
    let signals = vec![format!("{end}.x"), format!("{end}.y")];
    let mut scene = Scene { text, force: 1e-6, release: (number / KINDS.len()).is_multiple_of(2), stop: 1.0, signals };
    let linear = CompileOptions { linear: true, undamped: true, ..CompileOptions::default() };
    let drawn = scene.compiled(&linear, scene.force).unwrap_or_else(|e| panic!("scene {number}: {e}\n{}", scene.text));
    let at = static_equilibrium(&drawn, &[]).ok()?;
    let turned = at.nodes.iter().map(|(_, motion)| motion.rz.abs()).fold(0.0, f64::max);
    scene.force *= target / turned;
    let lowest = modes(&drawn, 1, &[]).ok()?;
    scene.stop = periods / lowest.frequencies_hz.first()?;
    Some(scene)
}

/// Rigid plates on flexures, in a chain or a tree; `held`: the last one by a flexure more. The name of the last plate.
fn plates(draw: &mut Numbers, text: &mut String, branch: bool, held: bool) -> String {
    let count = 2 + draw.below(6);
    let (size, width) = (draw.log(20e-6, 150e-6), draw.log(0.5e-6, 3e-6));
    text.push_str("anchor p1 [q(0)] []\n");
    for k in 1..=count {
        let from = if branch { draw.below(k) } else { k - 1 };
        let (l, w) = (size * draw.within(0.5, 1.5), size * draw.within(0.3, 1.2));
        let oz = if branch { draw.within(-1.5, 1.5) } else { draw.within(-0.5, 0.5) };
        let flexure = (size * draw.log(0.05, 1.0), width * draw.within(0.7, 1.4));
        let _ = writeln!(text, "beam2d p1 [q({from}) r({k})] [l={:e} w={:e} oz={oz:e}]", flexure.0, flexure.1);
        let _ = writeln!(text, "link2d * [r({k}) c({k})] [l={:e} oz={oz:e}]", l / 2.0);
        let _ = writeln!(text, "plate2d p1 [c({k})] [l={l:e} w={w:e} oz={oz:e}]");
        let _ = writeln!(text, "link2d * [c({k}) q({k})] [l={:e} oz={oz:e}]", l / 2.0);
    }
    if held {
        let (l, oz) = (size * draw.log(0.1, 1.0), draw.within(-1.5, 1.5));
        let _ = writeln!(text, "beam2d p1 [q({count}) e] [l={l:e} w={width:e} oz={oz:e}]\nanchor p1 [e] []");
    }
    format!("c({count})")
}

/// A tree of beams with some plates, and so many beams that close loops. The name of the last node.
fn beams(draw: &mut Numbers, text: &mut String, loops: usize) -> String {
    let size = draw.log(30e-6, 200e-6);
    let mut places = vec![(0.0, 0.0)];
    let mut joined = Vec::new();
    text.push_str("anchor p1 [n(0)] []\n");
    let count = 3 + draw.below(6);
    for k in 1..=count {
        let from = draw.below(k);
        let (x, y) = places[from];
        let mut place = (x, y);
        // branches keep a distance from what is there
        for _ in 0..50 {
            let (l, oz) = (size * draw.within(0.5, 1.3), draw.within(-3.1, 3.1));
            place = (x + l * f64::cos(oz), y + l * f64::sin(oz));
            if places.iter().all(|other| f64::hypot(other.0 - place.0, other.1 - place.1) > 0.4 * size) {
                break;
            }
        }
        places.push(place);
        joined.push((from, k));
    }
    let pairs: Vec<_> = (0..=count).flat_map(|b| (0..b).map(move |a| (a, b))).filter(|p| !joined.contains(p)).collect();
    for _ in 0..loops.min(pairs.len()) {
        let pair = pairs[draw.below(pairs.len())];
        if !joined.contains(&pair) {
            joined.push(pair);
        }
    }
    for (a, b) in joined {
        let way = (places[b].0 - places[a].0, places[b].1 - places[a].1);
        let (l, oz, w) = (f64::hypot(way.0, way.1), f64::atan2(way.1, way.0), draw.log(0.5e-6, 5e-6));
        let _ = writeln!(text, "beam2d p1 [n({a}) n({b})] [l={l:e} w={w:e} oz={oz:e}]");
    }
    for k in 1..=count {
        if draw.below(3) == 0 {
            let side = size * draw.within(0.1, 0.6);
            let _ = writeln!(text, "plate2d p1 [n({k})] [l={side:e} w={side:e}]");
        }
    }
    format!("n({count})")
}
