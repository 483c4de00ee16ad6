//! The response of the whole model to one drive at a complex frequency: one factorization of K + sC + s²M, one solve.

use super::named::{ResponseRow, drive_port, row, unit};
use super::options::HarmonicOptions;
use crate::AnalysisError;
use crate::readout::expression::Expression;
use crate::readout::ports::OpenedPorts;
use crate::readout::small_signal::{ForcedMotion, PerturbedState};
use crate::statics::{OperatingPoint, operating_point};
use bimorph_domains::{Drive, System};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;
use bimorph_solve::frequency::refined::Refined;
use bimorph_solve::harmonic::{ComplexPose, Harmonic};
use nalgebra::Complex;

/// Distance to a frequency at which a pivot vanishes, as a fraction of |s|; no pivot vanishes there.
const ASIDE: f64 = 1e-11;

/// A mechanism at its operating point, with what drives it and what is seen of it.
#[derive(Debug)]
pub(crate) struct ExactResponse<'a> {
    pub(super) compiled: &'a CompiledModel,
    ports: OpenedPorts,
    pub(super) point: OperatingPoint,
    still: Vec<Pose>,
    pub(super) drive: Drive,
    pub(crate) tangent: BodyMatrix,
    pub(super) harmonic: Harmonic,
    /// The tangent unsummed; none for a linear model, whose tangent is another one.
    refined: Option<Refined<'a>>,
    response: Vec<ComplexPose>,
    pub(crate) rows: Vec<Expression<ResponseRow>>,
    /// Name and unit of each row.
    pub(super) shown: Vec<(String, String)>,
    pub(super) drive_unit: &'static str,
    /// Nothing holds it: at rest it has no response.
    pub(super) floats: bool,
}

impl<'a> ExactResponse<'a> {
    /// Finds the operating point and the requested outputs.
    ///
    /// # Errors
    /// See [`AnalysisError`].
    pub(crate) fn new(compiled: &'a CompiledModel, options: &HarmonicOptions) -> Result<Self, AnalysisError> {
        let ports = drive_port(compiled, &options.drive)?;
        let signals = match options.signals.as_slice() {
            [] => vec![super::named::own_answer(compiled, &options.drive, &ports)?],
            signals => signals.to_vec(),
        };
        let rows = signals.iter().map(|name| row(compiled, name)).collect::<Result<Vec<_>, _>>()?;
        let drive_unit = ports.kinds[0].given().1;
        let shown = signals.iter().zip(&rows).map(|(name, row)| (name.clone(), unit(row, drive_unit))).collect();
        let (point, floats) = match operating_point(compiled, &options.voltages) {
            Ok(point) => {
                let free = !point.free_motions.is_empty();
                (point, free)
            }
            // a part that floats has no equilibrium, and needs none where nothing acts on it
            Err(AnalysisError::Singular { .. }) if unloaded(compiled, options) => {
                (OperatingPoint::rest(compiled, &options.voltages)?, true)
            }
            Err(error) => return Err(error),
        };
        let own = ports.system.clone();
        let system = own.as_deref().unwrap_or(&compiled.parts.system);
        let mut point = point;
        point.sources.resize(system.electrics.sources(), 0.0);
        let mut drive = system.electrics.drive();
        system.electrics.apply(&point.sources, &point.rise, &mut drive);
        let mut tangent = BodyMatrix::new(&system.model.pattern);
        let mut residual = point.q.clone();
        system.tangent(&point.q, &drive, &mut tangent, &mut residual);
        let bodies = system.bodies();
        // what drives has no value at the operating point: the same tangent without it
        let base = &compiled.parts.system;
        let mut undriven = base.electrics.drive();
        base.electrics.apply(&point.sources[..base.electrics.sources()], &point.rise, &mut undriven);
        let refined = (!base.model.linear).then(|| Refined::new(base, &point.q, &undriven));
        let mut harmonic = Harmonic::new(system);
        harmonic.about(system, &point.q);
        Ok(Self {
            refined,
            harmonic,
            compiled,
            point,
            still: vec![Pose::zeros(); bodies],
            drive,
            tangent,
            response: vec![ComplexPose::zeros(); bodies],
            rows,
            shown,
            drive_unit,
            floats,
            ports,
        })
    }

    /// Displacements and drive at the operating point.
    pub(crate) fn about(&self) -> (&[Pose], &Drive) {
        (&self.point.q, &self.drive)
    }

    /// The operating point alone.
    pub(crate) fn into_point(mut self) -> OperatingPoint {
        self.point.sources.truncate(self.compiled.parts.system.electrics.sources());
        self.point
    }

    /// The model with the drive among its sources.
    pub(crate) fn system(&self) -> &System {
        self.ports.system.as_deref().unwrap_or(&self.compiled.parts.system)
    }

    /// Index of the drive among the sources.
    pub(super) fn source(&self) -> usize {
        self.ports.sources[0]
    }

    /// The operating point for small changes.
    pub(super) fn perturbed(&self) -> PerturbedState<'_> {
        PerturbedState {
            compiled: self.compiled,
            system: self.system(),
            q: &self.point.q,
            v: &self.still,
            rise: &self.point.rise,
            sources: &self.point.sources,
            drive: &self.drive,
        }
    }

    /// Something that needs the storage for complex frequencies, too.
    pub(super) fn with_system<T>(&mut self, f: impl FnOnce(&System, &BodyMatrix, &mut Harmonic) -> T) -> T {
        let own = self.ports.system.clone();
        f(own.as_deref().unwrap_or(&self.compiled.parts.system), &self.tangent, &mut self.harmonic)
    }

    /// Each row for a unit e^(st) of the drive; none at a pole.
    pub(crate) fn at(&mut self, s: Complex<f64>) -> Option<Vec<Complex<f64>>> {
        bimorph_base::budget::check();
        let source = self.source();
        let push = self.perturbed().push(source, s);
        let own = self.ports.system.clone();
        let system = own.as_deref().unwrap_or(&self.compiled.parts.system);
        self.harmonic.factor_at(system, &self.tangent, s).ok()?;
        self.response.copy_from_slice(&push.force);
        self.harmonic.solve(system, &mut self.response);
        if let Some(refined) = &mut self.refined {
            self.harmonic.refine(system, refined, s, &push.force, &mut self.response);
        }
        let moved = ForcedMotion::new(&push, &self.response, s);
        let about = self.perturbed();
        let value = |row: &ResponseRow| match row {
            ResponseRow::Signal(signal) => about.signal_change(*signal, &moved),
            ResponseRow::Current(port) => s * about.charges(&[*port], &moved)[0] + push.currents[*port],
        };
        let values: Vec<Complex<f64>> = self.rows.iter().map(|row| row.sum(value)).collect();
        values.iter().all(|v| v.re.is_finite() && v.im.is_finite()).then_some(values)
    }

    /// The same at `s`, or next to it where a pivot vanishes: there a branch alone resonates, which is a zero of its parent.
    pub(super) fn beside(&mut self, s: Complex<f64>) -> Option<Vec<Complex<f64>>> {
        self.at(s).or_else(|| self.at(s * (1.0 + ASIDE)))
    }
}

/// True where nothing acts on the mechanism.
fn unloaded(compiled: &CompiledModel, options: &HarmonicOptions) -> bool {
    let system = &compiled.parts.system;
    options.voltages.iter().all(|(_, volts)| *volts == 0.0)
        && system.electrics.fixed.iter().all(|v| *v == 0.0)
        && system.loads.is_empty()
        && system.model.joints.iter().all(|j| j.rest == 0.0)
}
