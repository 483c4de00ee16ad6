//! The reduced model of a session, or why it has the full one.

use bimorph_analysis::readout::PortKind;
use bimorph_analysis::reduced::circuit::CircuitReduction;
use bimorph_domains::{Drive, System};
use bimorph_model::compile::{CompiledModel, Formulation};
use bimorph_multibody::forces;
use bimorph_multibody::planar::Pose;
use bimorph_solve::reduced::check::FullCheck;
use bimorph_solve::reduced::statics::ReducedStatics;
use bimorph_solve::time::method::Motion;
use bimorph_solve::time::reduced_rodas4::ReducedRodas4;
use std::sync::Arc;

/// The reduced model of a session with the storage of its equilibria.
#[derive(Debug)]
pub(crate) struct SessionReduction {
    pub(crate) model: Arc<CircuitReduction>,
    pub(crate) statics: ReducedStatics,
    pub(crate) check: FullCheck,
    pub(crate) error: ReductionErrorSum,
}

/// The error by the reduction of a motion, from the residual of the full model at some accepted states.
#[derive(Debug, Default)]
pub(crate) struct ReductionErrorSum {
    /// Sum of the squares of the errors in the mass norm (kg·m²), their number, and the largest displacement in that norm (√kg·m).
    squares: f64,
    count: f64,
    largest: f64,
    /// Accepted states.
    accepted: u64,
}

/// Unknowns of the full model for each coordinate from which on `auto` takes the reduced one (1).
const CHEAPER: usize = 10;
/// Accepted states from one residual to the next.
const EVERY: u64 = 20;

impl SessionReduction {
    /// The root mean square error by the reduction of the motion so far, of its or the training's largest displacement; with an accepted state `q`, `v` that carries
    /// `carried` under `drive`, the first of a motion where `begins`.
    pub(crate) fn seen(
        &mut self,
        system: &System,
        method: &mut ReducedRodas4,
        (q, v, carried): (&[Pose], &[Pose], &[Motion]),
        (drive, begins): (&Drive, bool),
    ) -> f64 {
        if begins {
            self.error = ReductionErrorSum::default();
        }
        let error = &mut self.error;
        error.accepted += 1;
        if error.accepted % EVERY == 1 {
            let push = method.consistent_accelerations(carried, (q, v), drive);
            let mut taken: Vec<Pose> =
                push.iter().enumerate().map(|(j, push)| system.model.mass(j).component_mul(push)).collect();
            forces::add_damping(&system.model, v, &mut taken);
            system.add_loss(q, |k| v[k], &mut taken);
            self.check.of(system, q, drive, Some(&taken));
            let squares = system.model.mass_product(self.check.step(), self.check.step());
            if squares.is_finite() {
                error.squares += squares;
                error.count += 1.0;
            }
            error.largest = error.largest.max(system.model.mass_product(q, q).sqrt());
        }
        (error.squares / error.count.max(1.0)).sqrt() / error.largest.max(method.largest())
    }
}

/// Ports of a session: names, sources and kinds.
pub(crate) type Ports<'a> = (&'a [String], &'a [usize], &'a [PortKind]);

impl SessionReduction {
    /// The reduced model that the options request for some ports, `known` if it was trained before; none where they request none. `shortest` is about the
    /// shortest time in which something moves (s).
    ///
    /// # Errors
    /// Why the session has the full model though a reduced one is requested.
    pub(crate) fn requested(
        compiled: &CompiledModel,
        system: &System,
        ports: Ports<'_>,
        times: (bool, f64),
        known: Option<&Arc<CircuitReduction>>,
    ) -> Result<Option<Self>, String> {
        match (compiled.requested.formulation, compiled.options.formulation) {
            (_, Formulation::Reduced) => Self::trained(compiled, system, ports, times, known).map(Some),
            (Formulation::Auto, Formulation::Auto | Formulation::Compliant) if compiled.options.ranges.is_some() => {
                let found = Self::trained(compiled, system, ports, times, known).ok();
                Ok(found.filter(|found| CHEAPER * found.model.space.size() <= system.model.unknowns()))
            }
            _ => Ok(None),
        }
    }

    /// A reduced model for some ports.
    ///
    /// # Errors
    /// Why there is none.
    fn trained(
        compiled: &CompiledModel,
        system: &System,
        (names, sources, kinds): Ports<'_>,
        (shaken, shortest): (bool, f64),
        known: Option<&Arc<CircuitReduction>>,
    ) -> Result<Self, String> {
        if shaken {
            return Err("thermal agitation acts on every body".to_owned());
        }
        if kinds.contains(&PortKind::Rate) {
            return Err("a port turns the frame, and its Coriolis forces are not in a reduced model".to_owned());
        }
        let model = match known {
            Some(known) => Arc::clone(known),
            None => Arc::new(CircuitReduction::train(compiled, system, (names, sources), shortest)?),
        };
        let (statics, check) = (ReducedStatics::new(&model.space), FullCheck::new(system));
        Ok(Self { statics, check, error: ReductionErrorSum::default(), model })
    }
}
