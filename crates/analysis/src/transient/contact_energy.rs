//! The energy of a run whose parts touch, which no impact may raise.
//!
//! Under constant voltages and loads the kinetic energy and the potential of a mechanism together do not grow. Steps
//! that are too long for an impact can make them grow without bound. They are therefore compared with those at the
//! start: at each step of equal steps, and otherwise at the stability checks of [`super::record`].

use super::super::AnalysisError;
use super::options::TransientOptions;
use bimorph_domains::{Drive, System};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::forces::kinetic_energy;
use bimorph_solve::time::method::Motion;

/// Energy that may be gained, of the largest kinetic energy so far (1).
const GAINED: f64 = 0.1;
/// Energy that may be gained at rest, of the energy itself (1).
const ROUNDING: f64 = 1e-9;

/// The energy of a run.
pub(super) struct ContactEnergy<'a> {
    system: &'a System,
    drive: Drive,
    start: f64,
    /// Largest kinetic energy so far (J).
    kinetic: f64,
}

impl<'a> ContactEnergy<'a> {
    /// From the start of a run; none where nothing can touch, heat or a shock does work, or forces are the derivatives of no energy.
    pub(super) fn start(
        compiled: &'a CompiledModel,
        options: &TransientOptions<'_>,
        motion: &Motion,
        drive: &Drive,
    ) -> Option<Self> {
        let system = &compiled.parts.system;
        let conserved = compiled.parts.heaters.is_empty()
            && options.shock.is_none()
            && options.motions.is_empty()
            && !compiled.options.as_sugar
            && !system.turns();
        (conserved && system.can_touch()).then(|| Self {
            system,
            drive: drive.clone(),
            start: system.energy(&motion.q, &motion.v, drive),
            kinetic: kinetic_energy(&system.model, &motion.v),
        })
    }

    /// After a step to time `t` (s); `look` where the energy is to be compared.
    ///
    /// # Errors
    /// [`AnalysisError::BadRequest`] where energy was gained.
    pub(super) fn step(
        &mut self,
        options: &TransientOptions<'_>,
        t: f64,
        motion: &Motion,
        look: bool,
    ) -> Result<(), AnalysisError> {
        self.kinetic = self.kinetic.max(kinetic_energy(&self.system.model, &motion.v));
        if !look {
            return Ok(());
        }
        // the stages of a step may touch where its ends do not
        let energy = self.system.energy(&motion.q, &motion.v, &self.drive);
        let gained = energy - self.start;
        if gained <= GAINED * self.kinetic + ROUNDING * energy.abs().max(self.start.abs()) {
            return Ok(());
        }
        let method = options.method.name();
        let (what, way) = match options.step {
            Some(step) => (format!("step {step:e}"), "take a shorter --step, none, or --method avf"),
            None => (format!("method {method}"), "take a smaller --tol, or the default method"),
        };
        Err(AnalysisError::BadRequest {
            what,
            detail: format!(
                "{method} has given the mechanism {gained:.1e} J at an impact by {t:.6e} s, where nothing else gives energy and the largest kinetic \
                 energy was {:.1e} J; {way}",
                self.kinetic
            ),
        })
    }
}
