//! `bimorph tran`: motion in time.

use super::failure::Failure;
use super::model::{JsonMap, ModelArgs, warn_of, warn_of_mesh};
use super::output::OutputArgs;
use super::solver::SolverChoice;
use super::tran_report::{ShockDocument, TransientDocument, picture, table, text};
use super::{draw_motion, progress, value, waveform};
use bimorph::analysis::chart::released;
use bimorph::analysis::chosen_run::{FittedRun, run_as_chosen};
use bimorph::analysis::formulation;
use bimorph::analysis::frame::{frame, frame_transient};
use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::joint_transient::{JointReport, joint_transient};
use bimorph::analysis::step_error::with_step_error;
use bimorph::analysis::transient::{TransientOptions, TransientResult, Until, transient};
use bimorph::analysis::{AnalysisError, ProgressCallback};
use bimorph::compile::{CompiledModel, Formulation};
use bimorph::domains::{InputWaveform, Shock};
use bimorph::multibody::joint_coordinates::sprung_loops::UnsupportedModel;
use bimorph::netlist::NetlistSource;
use bimorph::options::OptionValue;
use bimorph::options::analysis::{TRAN_POINTS, TRAN_RHO, TRAN_STEP, TRAN_STOP};
use clap::Args;
use std::path::PathBuf;

/// Motion in time, from rest or from a released equilibrium.
///
/// If the steps of a run prove to have a larger error than its mesh leaves of --tol, the run is repeated with sharper
/// ones, where that takes some seconds at most.
///
/// Signals: NODE.x, NODE.y [m], NODE.rz [rad], NODE.vx, NODE.vy [m/s], NODE.vrz [rad/s], BEAM.T [K], BEAM.stress [Pa], GAP.q [C], GAP.gap
/// [m], GAP.C [F], GAP.F, GAP.N [N], COMB.side [m], STOP.G [S], PORT.q [C], PORT.i [A]. JSON: "t": times [s]. "signals" and
/// "units" by name. "events": crossings of --event. "step_error": estimated error of the steps. "reliable_until" and "after_contact": time [s] up to
/// which single values hold --tol where parts bounce, and mean values after it.
/// "largest_stress": of the run, where a layer has a `strength` or a --shock acts.
#[derive(Debug, Args)]
#[command(after_help = "Methods, with their orders; steps follow --tol, or are equal with --step:\n  \
    rodas4 (4)             the default: one factorization a step; fast motions die out\n  \
    radau5 (5)             the most accurate; one real and one complex factorization a step; fast motions die out\n  \
    tr-bdf2 (2)            cheap and robust; fast motions die out\n  \
    generalized-alpha (2)  fast motions damped as chosen: --rho 0 (at once) to 1 (not at all); 0 alone for parts that touch\n  \
    avf (2)                keeps the energy of an undamped motion, whatever the step\n  \
    midpoint (2)           keeps the energy on average; not for parts that touch\n  \
    newmark (2)            average acceleration; may gain energy when steps are long; not for parts that touch\n  \
    sdirk4 (4)             five implicit stages; fast motions die out\n  \
    rk45 (5)               explicit: tiny steps, and needs inertia in every direction\n\
Joint coordinates (--formulation rcr, rcr-elastic) have rodas4, the default, with loops closed by springs; and rk45, tr-bdf2,\n\
sdirk4, midpoint, newmark and generalized-alpha with constraints reduced in the recursion: the paper's model of joints that\n\
only turn, and mechanisms of rigid loops, where rk45 is the default.\n\n\
Examples:\n  \
    bimorph tran examples/bank/bank.net --stop 300u --port heat=2.2 --signals yoke.y,b1.hot.T --out heat.svg\n  \
    # from the equilibrium under F = 100 µN, which is released at t = 0\n  \
    bimorph tran examples/quarter_stage/quarter_stage.net --set F=100u --release F --stop 30u --undamped --signals c.x --json\n  \
    # keeps the energy over many periods and lists each passage through the middle\n  \
    bimorph tran examples/quarter_stage/quarter_stage.net --set F=100u --release F --stop 30u --undamped --method avf --step 0.1u --event c.x=0\n  \
    bimorph tran examples/single_bimorph/single_bimorph.net --set F=10u --release F --stop 30u --draw motion.html\n  \
    # joint coordinates of joints that only turn; \"joint_coordinates\" in the document has n, m and the gaps\n  \
    bimorph tran examples/pivots/pivots.net --stop 20u --undamped --formulation rcr --method rk45 --scheme a2 --segments 1 --json")]
pub(crate) struct TransientCommand {
    #[command(flatten)]
    model: ModelArgs,

    /// End time [s], such as 30u
    #[arg(long, value_name = "SECONDS", value_parser = value::number, allow_negative_numbers = true)]
    stop: f64,

    /// Number of equally spaced output times, both ends included
    #[arg(long, default_value_t = TRAN_POINTS.count())]
    points: usize,

    /// Signals wanted, or sums such as top.C-0.5*bot.C: a,b or repeated [default: x and y of every free node]
    #[arg(long, value_name = "NAMES")]
    signals: Vec<String>,

    /// Start from the equilibrium at this parameter's value; the parameter is 0 from t = 0
    #[arg(long, value_name = "NAME")]
    release: Option<String>,

    /// Hold a port at a voltage [V], or a driven anchor at NODE.ux, .uy [m] or .urz [rad], from t = 0; others are at 0. Repeatable
    #[arg(long = "port", short = 'p', value_name = "NAME=VOLTS", value_parser = value::volts)]
    ports: Vec<(String, f64)>,

    /// Half-sine acceleration of the frame from t = 0: its peak [m/s², or 500g], its duration [s] and its direction [degrees from x, default: 0]
    #[arg(long, value_name = "PEAK,SECONDS[,DEGREES]", value_parser = value::shock, allow_negative_numbers = true)]
    shock: Option<Shock>,

    /// Move a driven anchor: NODE.ux, .uy [m] or .urz [rad] as 'sin(OFFSET AMPLITUDE HZ [DELAY])', 'pulse(FROM TO DELAY RISE FALL LENGTH [PERIOD])' or 'pwl(SECONDS VALUE …)'. Repeatable
    #[arg(long = "motion", value_name = "NAME=WAVEFORM", value_parser = waveform::motion)]
    motions: Vec<(String, InputWaveform)>,

    /// Integration method [default: rodas4; in joint coordinates whose loops do not close by springs rk45]
    #[arg(long, value_name = "NAME", value_parser = clap::builder::PossibleValuesParser::new(Integrator::NAMES))]
    method: Option<String>,

    /// Equal steps of this length [s], such as 0.5u [default: steps follow --tol]
    #[arg(long, value_name = "SECONDS", value_parser = value::number, allow_negative_numbers = true)]
    step: Option<f64>,

    /// Of generalized-alpha: factor by which an infinitely fast motion shrinks in a step, 0 to 1 [default: 0.8]
    #[arg(long, value_parser = value::number, allow_negative_numbers = true)]
    rho: Option<f64>,

    /// Print when a signal crosses a level, in the signal's SI unit. Repeatable
    #[arg(long = "event", value_name = "NAME=LEVEL", value_parser = value::volts)]
    events: Vec<(String, f64)>,

    /// End the run when parts touch (contact), part again (release), or a signal crosses a level in its SI unit (SIGNAL=VALUE)
    #[arg(long, value_name = "EVENT", value_parser = value::until)]
    until: Option<Until>,

    /// Draw the moving mechanism: a page with a slider (.html), or its last state (.svg, .png)
    #[arg(long, value_name = "FILE")]
    draw: Option<PathBuf>,

    /// Solver of the equations; all but the recursion are baselines to compare with
    #[arg(long, value_enum, default_value_t, help_heading = "Research and comparison", hide_short_help = true)]
    solver: SolverChoice,

    #[command(flatten)]
    output: OutputArgs,
}

/// The models of a finished run, and its method.
struct FinishedRun {
    fitted: CompiledModel,
    start: Option<CompiledModel>,
    joints: Option<JointReport>,
    method: Integrator,
}

impl TransientCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        self.check()?;
        let initial = match self.solver {
            SolverChoice::Frame => self.model.compile_frame()?,
            _ => self.model.compile_with_ranges()?,
        };
        self.check_ranges(&initial)?;
        let released = match &self.release {
            Some(name) => Some(released(&NetlistSource::new(&self.model.bundle()?), &initial, name)?),
            None => None,
        };
        let drawn = released.as_ref().unwrap_or(&initial);
        let method = self.integrator(drawn)?;
        let signals = if self.signals.is_empty() { free_nodes(drawn) } else { value::names(&self.signals) };
        let wanted = signals.len();
        let options = TransientOptions {
            stop: self.stop,
            signals,
            points: self.points,
            tol: drawn.options.errors().requested(),
            voltages: self.ports.clone(),
            release: released.as_ref().map(|_| &initial),
            shock: self.shock,
            motions: self.motions.clone(),
            method,
            step: self.step,
            events: self.events.clone(),
            until: self.until.clone(),
            solver: self.solver.linear(),
            estimate: false,
            keep: true,
            directions: None,
            reduction: None,
        };
        let (mut result, FinishedRun { fitted, start, joints, method }) = self.run_motion(drawn, &options)?;
        let (compiled, start) = (&fitted, start.as_ref());
        warn_of(&result.warnings);
        let pictured = result.signals.split_off(wanted);
        if let Some(path) = &self.draw {
            draw_motion::write(path, compiled, &self.model.title(), &result.t, &pictured)?;
        }

        let (mut signals, mut units) = (Vec::new(), Vec::new());
        for (name, unit, values) in &result.signals {
            signals.push((name.clone(), values.clone()));
            units.push((name.clone(), unit.clone()));
        }
        let document = TransientDocument {
            t: &result.t,
            signals: JsonMap(&signals),
            units: JsonMap(&units),
            method: if self.solver == SolverChoice::Frame { "newmark" } else { method.name() },
            counters: result.counters,
            events: &result.events,
            joint_coordinates: joints.clone(),
            formulation_taken: result.formulation_taken.as_deref(),
            unknowns: result.unknowns,
            step_error: result.step_error,
            stopped_at: result.stopped_at,
            reliable_until: result.reliable_until,
            after_contact: &result.after_contact,
            shock: self.shock.map(|shock| ShockDocument { peak_m_s2: shock.peak, duration_s: shock.duration }),
            largest_stress: result.largest_stress.as_ref(),
            solver: self.solver,
            release: self.release.as_deref(),
            port_voltages_v: JsonMap(&self.ports),
            context: self.model.context_of(start.unwrap_or(compiled), compiled).with(&result.warnings),
        };
        let title = self.model.title();
        let mut text = text(compiled, &result, joints.as_ref(), &self.events);
        let told = joints.is_some() || self.model.gives("formulation");
        if let Some(taken) = result.formulation_taken.as_ref().filter(|_| told) {
            text += &format!("formulation auto took {taken}\n");
        }
        self.output.finish(|| table(&title, &result), || Ok(picture(&title, &result)), &document, &text)
    }

    /// Ranges of ports are those of a reduced model from rest.
    fn check_ranges(&self, compiled: &CompiledModel) -> Result<(), Failure> {
        let Some(ranges) = &compiled.options.ranges else { return Ok(()) };
        let refused = |expected: &str| Err(Failure::bad("--ranges", expected, format!("\"{}\"", ranges.text())));
        if compiled.options.formulation != Formulation::Reduced {
            return refused("--formulation reduced beside it");
        }
        if self.release.is_some() {
            return refused("none with --release, which is trained for what it is released from");
        }
        match ranges.all().iter().all(|(name, _)| compiled.structure.port(name).is_some()) {
            true => Ok(()),
            false => refused("electrical ports of the model, whose voltages a run holds"),
        }
    }

    /// Each option within its range, before anything is compiled.
    fn check(&self) -> Result<(), Failure> {
        self.output.check()?;
        if let Some(path) = &self.draw {
            draw_motion::check(path)?;
            if self.solver == SolverChoice::Frame {
                return Err(Failure::bad("--draw", "--solver recursion or another of its equations", "--solver frame"));
            }
        }
        if self.solver == SolverChoice::Frame {
            let given = [
                ("--shock", self.shock.is_some()),
                ("--motion", !self.motions.is_empty()),
                ("--method", self.method.is_some()),
                ("--step", self.step.is_some()),
                ("--rho", self.rho.is_some()),
                ("--event", !self.events.is_empty()),
                ("--until", self.until.is_some()),
            ];
            if let Some((option, _)) = given.iter().find(|(_, given)| *given) {
                let got = "--solver frame, which moves from rest by Newmark's rule with steps of its own".to_owned();
                return Err(Failure::bad(option, "--solver recursion", got));
            }
        }
        TRAN_STOP.check(&OptionValue::Number(self.stop))?;
        TRAN_POINTS.check(&OptionValue::Count(self.points))?;
        TRAN_STEP.check(&self.step.map_or(OptionValue::Unset, OptionValue::Number))?;
        TRAN_RHO.check(&OptionValue::Number(self.rho.unwrap_or(TRAN_RHO.number())))?;
        Ok(())
    }

    /// The motion on its mesh, by the equations that were chosen.
    fn run_motion(
        &self,
        drawn: &CompiledModel,
        options: &TransientOptions<'_>,
    ) -> Result<(TransientResult, FinishedRun), Failure> {
        if self.solver == SolverChoice::Frame {
            let bar = progress::bar("transient");
            let watch = &mut progress::watch(&bar, self.cheaper(options.method));
            let result = frame(drawn).and_then(|frame| frame_transient(drawn, &frame, options, watch));
            bar.finish_and_clear();
            let start = options.release.cloned();
            return Ok((result?, FinishedRun { fitted: drawn.clone(), start, joints: None, method: options.method }));
        }
        let busy = progress::spinner("mesh");
        let mut attempt = |fitted: FittedRun, sample: &mut dyn FnMut(f64, &[f64]), watch: ProgressCallback<'_>| {
            busy.finish_and_clear();
            self.attempt(drawn, fitted, options, sample, watch)
        };
        let done = run_as_chosen(drawn, options, &mut attempt, &mut |_, _| (), &mut |_| true);
        busy.finish_and_clear();
        Ok(done?)
    }

    /// One run on its mesh.
    fn attempt(
        &self,
        drawn: &CompiledModel,
        FittedRun { moving, start, is_tentative }: FittedRun,
        options: &TransientOptions<'_>,
        sample: &mut dyn FnMut(f64, &[f64]),
        goes_on: ProgressCallback<'_>,
    ) -> Result<(TransientResult, FinishedRun), AnalysisError> {
        if !is_tentative {
            warn_of_mesh(drawn, &moving);
        }
        let mut signals = options.signals.clone();
        if self.draw.is_some() {
            signals.extend(draw_motion::signals(&moving));
        }
        let options = options.with_signals(signals);
        let options = options.with_release(start.as_ref());
        let (_, method) = formulation::of_run(&moving, &options);
        let bar = progress::bar("transient");
        let shown = &mut progress::watch(&bar, self.cheaper(method));
        let mut run =
            |options: &TransientOptions<'_>, sample: &mut dyn FnMut(f64, &[f64]), watch: ProgressCallback<'_>| {
                let (chosen, method) = formulation::of_run(&moving, options);
                match chosen.formulation {
                    formulation @ (Formulation::Rcr | Formulation::RcrElastic) => {
                        let options = options.with_method(method);
                        joint_transient(&moving, formulation, &options, sample, watch).map(|(r, j)| (r, Some(j)))
                    }
                    _ => transient(&moving, options, sample, watch).map(|r| (r, None)),
                }
            };
        let done = with_step_error(&options, &moving, &mut run, sample, &mut |f| goes_on(f) && shown(f));
        bar.finish_and_clear();
        let (result, joints) = done?;
        if is_tentative {
            warn_of_mesh(drawn, &moving);
        }
        Ok((result, FinishedRun { fitted: moving, start, joints, method }))
    }

    /// Options that make the run cheaper.
    fn cheaper(&self, method: Integrator) -> &'static str {
        match (self.step, method) {
            (Some(_), _) => "a longer --step or a shorter --stop costs less",
            (None, Integrator::Rk45) => {
                "--method tr-bdf2 has steps as long as --tol allows; a shorter --stop costs less"
            }
            _ => "ten times the --tol takes a tenth to a half of the steps; a shorter --stop costs less",
        }
    }

    fn integrator(&self, compiled: &CompiledModel) -> Result<Integrator, Failure> {
        let implicit = compiled.joints.is_none();
        // mechanisms of rigid loops have explicit steps
        let name = self.method.as_deref().unwrap_or(match &compiled.joints {
            Some(Err(UnsupportedModel::RigidLoop { .. })) => "rk45",
            _ => "rodas4",
        });
        let unknown = || Failure::bad("--method", "the name of an integrator", name.to_owned());
        let method = Integrator::named(name).ok_or_else(unknown)?;
        if !implicit && !Integrator::IN_JOINTS.contains(&method.name()) {
            let expected = format!("one of {} in joint coordinates", Integrator::IN_JOINTS.join(", "));
            return Err(Failure::bad("--method", &expected, name.to_owned()));
        }
        if !implicit && method == Integrator::Rk45 && self.step.is_some() {
            return Err(Failure::bad("--step", "an implicit --method in joint coordinates beside it", name.to_owned()));
        }
        if !implicit && self.solver != SolverChoice::Recursion {
            return Err(Failure::bad(
                "--solver",
                "recursion in joint coordinates",
                format!("{:?}", self.solver).to_lowercase(),
            ));
        }
        match (method, self.rho) {
            (Integrator::GeneralizedAlpha { .. }, Some(rho)) => Ok(Integrator::GeneralizedAlpha { rho }),
            (_, Some(_)) => Err(Failure::bad("--rho", "--method generalized-alpha beside it", name.to_owned())),
            (method, None) => Ok(method),
        }
    }
}

/// x and y of every mechanical node that nothing holds.
fn free_nodes(compiled: &CompiledModel) -> Vec<String> {
    let structure = &compiled.structure;
    let held = |id: usize| structure.supports.iter().any(|s| s.node.0 == id && s.held == [true; 3]);
    let free = structure.nodes.iter().enumerate().filter(|(id, node)| node.mechanical && !held(*id));
    free.flat_map(|(_, node)| [format!("{}.x", node.name), format!("{}.y", node.name)]).collect()
}
