//! One source raised from rest until a gap closes.

use super::super::AnalysisError;
use super::super::contact_range::{comb_aside, within_contact_range};
use bimorph_domains::{Domain, System};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;
use bimorph_solve::SolveError;
use bimorph_solve::continuation::{Continuation, ContinuationOptions, PathEnd, TracedPath};
use bimorph_solve::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph_solve::family::LoadFamily;
use bimorph_solve::path::SourcePath;

/// How far beyond a limit point a fall begins, as a fraction of its voltage.
pub(super) const PAST: f64 = 1e-3;
/// Halvings of a step, at most, where the branch does not lead to its limit point.
const BISECTIONS: usize = 40;
/// Relative accuracy of a voltage found so (1).
const SHARP: f64 = 1e-8;
/// Most limit points with rising voltage, or with falling voltage.
pub(super) const MAX_LIMIT_POINTS: usize = 200;
/// Jumps that are named.
const MAX_NAMED: usize = 4;
/// Points of one piece of a branch.
const MAX_POINTS: usize = 20_000;

/// State of a part beyond pull-in.
pub(super) enum PostPullIn {
    /// It rests on contact: voltage of the limit point, and an equilibrium beyond.
    Rests { fold: f64, volts: f64, q: Vec<Pose> },
    /// Nothing holds it.
    Falls { volts: f64 },
}

/// One source raised and lowered.
pub(super) struct VoltageSweep<'a> {
    pub(super) compiled: &'a CompiledModel,
    pub(super) system: &'a System,
    /// Source voltages with the swept one at 0 V.
    off: Vec<f64>,
    source: usize,
    /// Sign of the swept voltage: −1 where it falls from 0 V.
    sign: f64,
    /// Pull-in of the opposite polarity, as a sentence.
    pub(super) opposite: Option<String>,
    equilibrium: Equilibrium,
    /// Stability losses before any voltage, as a sentence.
    jumped: Option<&'static str>,
    /// Which gaps are closed without any voltage.
    pub(super) rest: Vec<bool>,
    /// Voltages at which it jumped without closing a gap (V).
    passed: Vec<f64>,
    /// Sentences about the closed branch.
    pub(super) of_closed: Vec<String>,
}

impl<'a> VoltageSweep<'a> {
    /// Of a `source`, all others at the voltages `off` (V).
    pub(super) fn new(compiled: &'a CompiledModel, off: Vec<f64>, source: usize) -> Self {
        let system = &compiled.parts.system;
        Self {
            compiled,
            system,
            off,
            source,
            sign: 1.0,
            opposite: None,
            equilibrium: Equilibrium::new(system, EquilibriumOptions::with_side(compiled.options.other_branch)),
            jumped: None,
            rest: Vec::new(),
            passed: Vec::new(),
            of_closed: Vec::new(),
        }
    }

    /// The same with the opposite polarity.
    pub(super) fn reversed(&self) -> Self {
        Self { sign: -self.sign, ..Self::new(self.compiled, self.off.clone(), self.source) }
    }

    fn sources(&self, volts: f64) -> Vec<f64> {
        let mut u = self.off.clone();
        u[self.source] = self.sign * volts;
        u
    }

    /// Whether the source is across a gap.
    pub(super) fn drives(&self, gap: usize) -> bool {
        self.system.electrics.drives(self.source, gap)
    }

    pub(super) fn touching(&self, q: &[Pose]) -> Vec<bool> {
        (0..self.system.members.len()).map(|g| self.system.touches(g, q)).collect()
    }

    /// The equilibrium at 0 V.
    pub(super) fn at_rest(&mut self) -> Result<Vec<Pose>, AnalysisError> {
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
    pub(super) fn close(&mut self, mut q: Vec<Pose>, max: f64) -> Result<PostPullIn, AnalysisError> {
        let unit = self.unit(&q, max)?;
        let mut from = 0.0;
        for _ in 0..MAX_LIMIT_POINTS {
            let traced = self.trace(&q, from, from + unit, (max - from) / unit)?;
            let last = last(&traced);
            let fold = from + last.0 * unit;
            if traced.end == PathEnd::Arrived {
                return Err(self.nothing(max, &q));
            }
            let before = last.1;
            q.copy_from_slice(&before);
            let beyond = fold * (1.0 + PAST);
            let fallen = self.fall(&mut q, beyond);
            if let Some((comb, _)) = comb_aside(self.compiled, &q, |gap| self.drives(gap)) {
                self.of_closed.push(format!(
                    "the fingers of the comb `{comb}` are drawn aside of their gaps there, where they do not overlap and nothing stops them: a stiffer \
                     suspension across the fingers or wider gaps raise this voltage"
                ));
                return Ok(PostPullIn::Falls { volts: fold });
            }
            match fallen {
                // nothing here could ever hold the part
                Err(_) if (0..self.system.members.len()).all(|g| self.system.touching(g).is_none()) => {
                    return Ok(PostPullIn::Falls { volts: fold });
                }
                fallen => fallen?,
            }
            within_contact_range(self.compiled, &q, |gap| self.drives(gap))?;
            let (system, touched) = (self.system, self.touching(&before));
            let apart = |q: &[Pose]| (0..touched.len()).all(|g| touched[g] || !system.touches(g, q));
            if !apart(&q) {
                let lost = traced.end != PathEnd::Unstable;
                let fold = if lost { self.sharpen(&before, fold, beyond, apart) } else { fold };
                return Ok(PostPullIn::Rests { fold, volts: beyond, q });
            }
            self.passed.push(fold);
            if beyond >= max {
                return Err(self.nothing(max, &q));
            }
            from = beyond;
        }
        let port = &self.system.electrics.names[self.source];
        let detail =
            format!("no pull-in found after {MAX_LIMIT_POINTS} folds of the open branch, at {port} = {from:.6} V");
        Err(AnalysisError::NoEquilibrium { detail, coarse: Vec::new(), overbent: false })
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
            None if self.only_combs() => "the force of combs along their fingers does not grow as they close, and the fingers stay in their gaps up to \
                 that voltage"
                .into(),
            None => "raise the largest voltage".into(),
        };
        let detail = format!("{name} pulls nothing in up to {max} V; {way_out}");
        AnalysisError::NoEquilibrium { detail, coarse: Vec::new(), overbent: false }
    }

    /// True where the source drives the fields of combs alone.
    fn only_combs(&self) -> bool {
        let mut gaps = (0..self.system.members.len()).filter(|g| self.drives(*g)).peekable();
        gaps.peek().is_some() && gaps.all(|g| !self.system.members[g].is_electrostatic())
    }

    /// Sentences about jumps during the sweep and about the closed branch.
    pub(super) fn warnings(&self) -> Vec<String> {
        let passed = match self.passed.as_slice() {
            [] => None,
            some => {
                Some(format!("before that it jumps at {} without closing a gap, and continues from there", named(some)))
            }
        };
        let jumped = self.jumped.map(str::to_owned);
        jumped.into_iter().chain(passed).chain(self.of_closed.clone()).chain(self.opposite.clone()).collect()
    }

    /// The voltage at which contact begins or ends where no fold was found, between `holds` and `falls`: by bisection on whether
    /// the part, let fall from its equilibrium `q` at `holds`, is `kept`.
    pub(super) fn sharpen(
        &mut self,
        q: &[Pose],
        mut holds: f64,
        mut falls: f64,
        kept: impl Fn(&[Pose]) -> bool,
    ) -> f64 {
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

    pub(super) fn fall(&mut self, q: &mut [Pose], volts: f64) -> Result<(), SolveError> {
        let sources = self.sources(volts);
        let path = SourcePath::new(&self.system.electrics, &sources, &sources, [1.0, 1.0]);
        self.equilibrium.settle(self.system, &path, 1.0, q).map(|_| ())
    }

    /// The branch from the equilibrium `q` at `from` volts through s·`to` + (1 − s)·`from`, until `target` or until it is
    /// no longer stable, by steps of a twentieth at least.
    pub(super) fn trace(&mut self, q: &[Pose], from: f64, to: f64, target: f64) -> Result<TracedPath, AnalysisError> {
        self.trace_by(0.05, q, [from, to], target)
    }

    /// The same by steps of another `growth`.
    pub(super) fn trace_by(
        &mut self,
        growth: f64,
        q: &[Pose],
        [from, to]: [f64; 2],
        target: f64,
    ) -> Result<TracedPath, AnalysisError> {
        let system = self.system;
        let mut family = LoadFamily::new(system, &self.sources(from), system, &self.sources(to))
            .map_err(|e| AnalysisError::BadRequest { what: "pull-in".into(), detail: e.to_string() })?;
        let options = ContinuationOptions {
            longest: growth,
            growth,
            target,
            points: MAX_POINTS,
            stop_at_loss: true,
            ..ContinuationOptions::default()
        };
        Ok(Continuation::new(system, options).trace(&mut family, q, &mut |_| true)?)
    }

    /// The voltage that moves the part by a tenth of the length scale, or removes a third of a stiffness, whichever is
    /// smaller: the unit of steps (V). `max` where it does neither.
    fn unit(&self, q: &[Pose], max: f64) -> Result<f64, AnalysisError> {
        let system = self.system;
        let electrics = &system.electrics;
        let mut tangent = BodyMatrix::new(&system.model.pattern);
        let mut rise = vec![0.0; electrics.heating.states()];
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
        let far = moved.iter().map(|p| p.xy().norm().max(p.z.abs() * system.length_scale)).fold(0.0, f64::max);
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
pub(super) fn last(traced: &TracedPath) -> (f64, Vec<Pose>) {
    traced.points.last().map(|p| (p.s, p.q.clone())).unwrap_or_default()
}

/// The first of some voltages, as a sentence names them.
pub(super) fn named(volts: &[f64]) -> String {
    let some: Vec<String> = volts.iter().take(MAX_NAMED).map(|v| format!("{v:.4}")).collect();
    let more = if volts.len() > MAX_NAMED { ", …" } else { "" };
    format!("{}{more} V", some.join(", "))
}
