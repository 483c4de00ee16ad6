//! Pull-in and release voltages.
//!
//! The branch of equilibria is followed by arc length, from 0 V upwards, to where it loses its stability: a fold, or a
//! bifurcation of what is drawn symmetrical. A little beyond, the part falls to what holds it. Where a gap has closed that
//! was open, this was pull-in; where none has, the branch goes on from there. Downwards the closed branch is followed in the
//! same way: after each fold the part falls again, and while one of the gaps that pull-in closed still touches (a beam that
//! peels off piece by piece) it goes on. Voltages are measured in what moves this part, so that no step depends on the
//! largest voltage asked for.

mod result;

use super::AnalysisError;
use super::contact_range::within_contact_range;
use super::statics::source_vector;
use crate::compile::Compiled;
use crate::domains::{Domain, System};
use crate::multibody::BlockMatrix;
use crate::multibody::planar::Pose;
use crate::solve::SolveError;
use crate::solve::continuation::{Continuation, ContinuationOptions, PathEnd, Traced};
use crate::solve::equilibrium::{Equilibrium, EquilibriumOptions};
use crate::solve::family::Blend;
use crate::solve::path::SourcePath;
pub use result::PullInResult;

/// How far beyond a fold a part is let fall, as a share of its voltage.
const PAST: f64 = 1e-3;
/// Halvings of a step, at most, where the branch itself does not lead to its fold.
const BISECTIONS: usize = 40;
/// Share of a voltage to which it is found so.
const SHARP: f64 = 1e-8;
/// Folds on the way up, or on the way down, after which the search gives up.
const MOST_FOLDS: usize = 200;
/// Jumps that are named.
const MOST_NAMED: usize = 4;
/// Points of one piece of a branch.
const MOST_POINTS: usize = 20_000;

/// Follows the equilibrium up to `max` volts on `port` (none: the first port, else the first source of the netlist), then
/// down again. The other ports stay at 0 V, the netlist's other sources at their voltage.
///
/// # Errors
/// See [`AnalysisError`]; `NoEquilibrium` when nothing pulls in below `max`.
pub fn pull_in(compiled: &Compiled, port: Option<&str>, max: f64) -> Result<PullInResult, AnalysisError> {
    let source = source(compiled, port)?;
    if !(max.is_finite() && max > 0.0) {
        return Err(AnalysisError::BadRequest {
            what: "largest voltage".into(),
            detail: format!("{max} is not a positive number of volts"),
        });
    }
    let system = &compiled.parts.system;
    let (rows, heating) = (&system.electrics.gap_rows, &system.electrics.heating);
    let pulls = |source: usize| (0..system.members.len()).any(|gap| rows[(gap, source)] != 0.0);
    // what is heated may be pushed to where another voltage closes a gap
    let pushes = system.members.iter().any(Domain::is_gap)
        && (0..heating.heaters.len()).any(|k| heating.current(k, source) != 0.0);
    if !pulls(source) && !pushes {
        let names = &system.electrics.names;
        let others: Vec<&str> = (0..names.len()).filter(|k| pulls(*k)).map(|k| names[k].as_str()).collect();
        let detail = format!(
            "it acts on no gap; of the others do {}",
            if others.is_empty() { "none".into() } else { others.join(", ") }
        );
        return Err(AnalysisError::BadRequest { what: format!("port \"{}\"", names[source]), detail });
    }
    let mut off = source_vector(compiled, &[])?;
    off[source] = 0.0;
    let mut sweep = Sweep {
        compiled,
        system,
        off,
        source,
        equilibrium: Equilibrium::new(system, EquilibriumOptions::default()),
        jumped: None,
        rest: Vec::new(),
        passed: Vec::new(),
    };
    let name = system.electrics.names[source].clone();
    let estimated_error = compiled.order.estimated_error;
    let q = sweep.at_rest()?;
    match sweep.close(q, max)? {
        Closed::Falls { volts } => Ok(PullInResult {
            port: name,
            pull_in_v: volts,
            release_v: None,
            held: false,
            estimated_error,
            warnings: sweep.told(),
        }),
        Closed::Rests { fold, volts, q } => {
            let made: Vec<usize> = (0..sweep.rest.len()).filter(|&g| !sweep.rest[g] && system.touches(g, &q)).collect();
            let release_v = sweep.release(q, volts, &made)?;
            Ok(PullInResult {
                port: name,
                pull_in_v: fold,
                release_v,
                held: true,
                estimated_error,
                warnings: sweep.told(),
            })
        }
    }
}

/// Index of the source to sweep.
fn source(compiled: &Compiled, port: Option<&str>) -> Result<usize, AnalysisError> {
    let names = &compiled.parts.system.electrics.names;
    let found = match port {
        Some(name) => names.iter().position(|n| n == name),
        None => (!names.is_empty()).then_some(0),
    };
    found.ok_or_else(|| AnalysisError::BadRequest {
        what: port.map_or_else(|| "pull-in".to_owned(), |port| format!("port \"{port}\"")),
        detail: match names.len() {
            0 => "the netlist has no port and no voltage source to sweep".into(),
            _ => format!("the netlist's ports and sources are {}", names.join(", ")),
        },
    })
}

/// What became of a part beyond pull-in.
enum Closed {
    /// It rests on contact: voltage of the fold, and an equilibrium beyond.
    Rests { fold: f64, volts: f64, q: Vec<Pose> },
    /// Nothing holds it.
    Falls { volts: f64 },
}

/// One source raised and lowered.
struct Sweep<'a> {
    compiled: &'a Compiled,
    system: &'a System,
    /// Source voltages with the swept one at 0 V.
    off: Vec<f64>,
    source: usize,
    equilibrium: Equilibrium,
    /// What the part did before any voltage, where it did not just give way.
    jumped: Option<&'static str>,
    /// Which gaps are closed without any voltage.
    rest: Vec<bool>,
    /// Voltages at which it jumped without closing a gap [V].
    passed: Vec<f64>,
}

impl Sweep<'_> {
    fn sources(&self, volts: f64) -> Vec<f64> {
        let mut u = self.off.clone();
        u[self.source] = volts;
        u
    }

    fn touching(&self, q: &[Pose]) -> Vec<bool> {
        (0..self.system.members.len()).map(|g| self.system.touches(g, q)).collect()
    }

    /// The equilibrium at 0 V.
    fn at_rest(&mut self) -> Result<Vec<Pose>, AnalysisError> {
        let mut q = vec![Pose::zeros(); self.system.bodies()];
        let rest = vec![0.0; self.off.len()];
        let path = SourcePath::new(&self.system.electrics, &rest, &self.off, [0.0, 1.0]);
        let path = self.equilibrium.follow(self.system, &path, &mut q)?;
        self.jumped = (!path.passed.is_empty()).then_some(
            "without any voltage the part has snapped through or buckled: these voltages are those of one of its branches; \
             `bimorph path` shows them, --imperfection chooses",
        );
        self.rest = self.touching(&q);
        Ok(q)
    }

    /// From 0 V up to pull-in, and to what holds the part beyond.
    fn close(&mut self, mut q: Vec<Pose>, max: f64) -> Result<Closed, AnalysisError> {
        let unit = self.unit(&q, max)?;
        let mut from = 0.0;
        for _ in 0..MOST_FOLDS {
            let traced = self.trace(&q, from, from + unit, (max - from) / unit)?;
            let last = last(&traced);
            let fold = from + last.0 * unit;
            if traced.end == PathEnd::Arrived {
                return Err(self.nothing(max, &q));
            }
            let before = last.1;
            q.copy_from_slice(&before);
            let beyond = fold * (1.0 + PAST);
            match self.fall(&mut q, beyond) {
                // nothing here could ever hold the part
                Err(_) if (0..self.system.members.len()).all(|g| self.system.touching(g).is_none()) => {
                    return Ok(Closed::Falls { volts: fold });
                }
                fallen => fallen?,
            }
            within_contact_range(self.compiled, &q)?;
            let (system, touched) = (self.system, self.touching(&before));
            let apart = |q: &[Pose]| (0..touched.len()).all(|g| touched[g] || !system.touches(g, q));
            if !apart(&q) {
                let lost = traced.end != PathEnd::Unstable;
                let fold = if lost { self.sharpen(&before, fold, beyond, apart) } else { fold };
                return Ok(Closed::Rests { fold, volts: beyond, q });
            }
            self.passed.push(fold);
            if beyond >= max {
                return Err(self.nothing(max, &q));
            }
            from = beyond;
        }
        let port = &self.system.electrics.names[self.source];
        let detail = format!("no pull-in found after {MOST_FOLDS} folds of the open branch, at {port} = {from:.6} V");
        Err(AnalysisError::NoEquilibrium { detail })
    }

    /// Why there is no pull-in up to `max`, for a part that is at `q` before the last piece of its way.
    fn nothing(&self, max: f64, q: &[Pose]) -> AnalysisError {
        let name = &self.system.electrics.names[self.source];
        let gap = |gap: usize| &self.compiled.parts.gap_names[gap];
        let way_out = match self.touching(q).iter().position(|touches| *touches) {
            Some(shut) if self.rest[shut] && self.jumped.is_some() => {
                format!("the part, unstable where it is drawn or on its way from there, rests on `{}`", gap(shut))
            }
            Some(shut) => format!("`{}` is closed already before that", gap(shut)),
            None => "raise the largest voltage; a comb's force does not grow as it closes: it pulls nothing in".into(),
        };
        AnalysisError::NoEquilibrium { detail: format!("{name} pulls nothing in up to {max} V; {way_out}") }
    }

    /// What the voltages do not say by themselves.
    fn told(&self) -> Vec<String> {
        let passed = match self.passed.as_slice() {
            [] => None,
            some => {
                let volts: Vec<String> = some.iter().take(MOST_NAMED).map(|v| format!("{v:.4}")).collect();
                let more = if some.len() > MOST_NAMED { ", …" } else { "" };
                Some(format!(
                    "on the way it jumps at {}{more} V without closing a gap, and goes on from there",
                    volts.join(", ")
                ))
            }
        };
        self.jumped.map(str::to_owned).into_iter().chain(passed).collect()
    }

    /// From the closed state `q` at `volts` down to where none of the gaps `made` touches any more.
    fn release(&mut self, mut q: Vec<Pose>, mut volts: f64, made: &[usize]) -> Result<Option<f64>, AnalysisError> {
        let system = self.system;
        let free = |q: &[Pose]| made.iter().all(|&g| !system.touches(g, q));
        for _ in 0..MOST_FOLDS {
            let traced = self.trace(&q, volts, 0.0, 1.0)?;
            let at = |s: f64| volts * (1.0 - s);
            if let Some(k) = traced.points.iter().position(|p| free(&p.q)) {
                // contact is lost without a fold
                let (before, after) = (&traced.points[k.saturating_sub(1)], &traced.points[k]);
                return Ok(Some(self.sharpen(&before.q, at(before.s), at(after.s), |q| !free(q))));
            }
            if traced.end == PathEnd::Arrived {
                return Ok(None);
            }
            let last = last(&traced);
            let fold = at(last.0);
            let before = last.1;
            q.copy_from_slice(&before);
            let beyond = fold * (1.0 - PAST);
            self.fall(&mut q, beyond)?;
            if free(&q) {
                let lost = traced.end != PathEnd::Unstable;
                return Ok(Some(if lost { self.sharpen(&before, fold, beyond, |q| !free(q)) } else { fold }));
            }
            volts = beyond;
        }
        Err(AnalysisError::NoEquilibrium {
            detail: format!("no release found after {MOST_FOLDS} folds of the closed branch"),
        })
    }

    /// The voltage at which contact begins or ends where no fold was found, between `holds` and `falls`: by bisection on whether
    /// the part, let fall from its equilibrium `q` at `holds`, is `kept`.
    fn sharpen(&mut self, q: &[Pose], mut holds: f64, mut falls: f64, kept: impl Fn(&[Pose]) -> bool) -> f64 {
        for _ in 0..BISECTIONS {
            if (holds - falls).abs() <= SHARP * falls.abs() {
                break;
            }
            let (middle, mut there) = (f64::midpoint(holds, falls), q.to_vec());
            match self.fall(&mut there, middle) {
                Ok(()) if kept(&there) => holds = middle,
                _ => falls = middle,
            }
        }
        holds
    }

    fn fall(&mut self, q: &mut [Pose], volts: f64) -> Result<(), SolveError> {
        let sources = self.sources(volts);
        let path = SourcePath::new(&self.system.electrics, &sources, &sources, [1.0, 1.0]);
        self.equilibrium.settle(self.system, &path, 1.0, q).map(|_| ())
    }

    /// The branch from the equilibrium `q` at `from` volts through s·`to` + (1 − s)·`from`, until `target` or until it is
    /// no longer stable.
    fn trace(&mut self, q: &[Pose], from: f64, to: f64, target: f64) -> Result<Traced, AnalysisError> {
        let system = self.system;
        let mut family = Blend::new(system, &self.sources(from), system, &self.sources(to))
            .map_err(|e| AnalysisError::BadRequest { what: "pull-in".into(), detail: e.to_string() })?;
        let options = ContinuationOptions {
            longest: 0.05,
            growth: 0.05,
            target,
            points: MOST_POINTS,
            stop_at_loss: true,
            ..ContinuationOptions::default()
        };
        Ok(Continuation::new(system, options).trace(&mut family, q, &mut |_| true)?)
    }

    /// The voltage that moves the part by a tenth of the length scale, or takes a third of a stiffness away, whichever is
    /// smaller: what steps are measured in [V]. `max` where it does neither.
    fn unit(&self, q: &[Pose], max: f64) -> Result<f64, AnalysisError> {
        let system = self.system;
        let electrics = &system.electrics;
        let mut tangent = BlockMatrix::new(&system.model.pattern);
        let mut rise = vec![0.0; electrics.heating.heaters.len()];
        let mut residual = [vec![Pose::zeros(); q.len()], vec![Pose::zeros(); q.len()]];
        let mut drive = electrics.drive();
        for (r, volts) in residual.iter_mut().zip([1.0, 0.0]) {
            electrics.steady(&self.sources(volts), &mut rise, &mut drive);
            system.tangent(q, &drive, &mut tangent, r);
        }
        system.model.project_matrix(&mut tangent);
        tangent.factor(&system.model.pattern).map_err(|p| SolveError::singular(system, p))?;
        let [mut moved, still] = residual;
        moved.iter_mut().zip(&still).for_each(|(a, b)| *a -= b);
        tangent.solve(&system.model.pattern, &mut moved);
        let far = moved.iter().map(|p| p.xy().amax().max(p.z.abs() * system.length_scale)).fold(0.0, f64::max);
        let mut unit = (0.1 * system.length_scale / far).sqrt().min(max);
        let mut volts = 1e-3 * unit;
        while volts < unit {
            electrics.steady(&self.sources(volts), &mut rise, &mut drive);
            system.tangent(q, &drive, &mut tangent, &mut moved);
            system.model.project_matrix(&mut tangent);
            if !matches!(tangent.factor(&system.model.pattern), Ok(inertia) if inertia.negative == 0) {
                unit = 0.3 * volts;
                break;
            }
            volts *= 1.5;
        }
        Ok(unit)
    }
}

/// s and configuration of the last point.
fn last(traced: &Traced) -> (f64, Vec<Pose>) {
    traced.points.last().map(|p| (p.s, p.q.clone())).unwrap_or_default()
}
