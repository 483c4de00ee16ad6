//! Options of a model with one of them changed, and the division of their tolerance. No other place copies options to change one.

use super::{
    Anchors, CompileOptions, Formulation, Junctions, ModelOption, OptionError, OptionValue, PortRanges, Scheme,
};
use bimorph_base::{ErrorBudget, Setting};

impl CompileOptions {
    /// The division of the tolerance.
    pub fn errors(&self) -> ErrorBudget {
        ErrorBudget::of(self.tol)
    }

    /// With another tolerance (1).
    #[must_use]
    pub fn with_tolerance(&self, tolerance: f64) -> Self {
        Self { tol: tolerance, ..self.clone() }
    }

    /// With another band (Hz); none: the analysis decides.
    #[must_use]
    pub fn with_band(&self, band: Option<f64>) -> Self {
        Self { band, ..self.clone() }
    }

    /// With another scheme of beams.
    #[must_use]
    pub fn with_scheme(&self, scheme: Scheme) -> Self {
        Self { scheme, ..self.clone() }
    }

    /// In another formulation.
    #[must_use]
    pub fn with_formulation(&self, formulation: Formulation) -> Self {
        Self { formulation, ..self.clone() }
    }

    /// With other ranges of ports.
    #[must_use]
    pub fn with_ranges(&self, ranges: PortRanges) -> Self {
        Self { ranges: Some(ranges), ..self.clone() }
    }

    /// With the inertia of sections that turn.
    #[must_use]
    pub fn with_rotary_inertia(&self) -> Self {
        Self { rotary_inertia: true, ..self.clone() }
    }

    /// With so many segments of every beam, whatever the band.
    #[must_use]
    pub fn with_segments(&self, segments: usize) -> Self {
        Self { segments: Some(segments), band: None, ..self.clone() }
    }

    /// With centrelines that meet in points and rigid anchors, as a frame has them.
    #[must_use]
    pub fn with_centrelines(&self) -> Self {
        Self { junctions: Junctions::Centreline, anchors: Anchors::Rigid, ..self.clone() }
    }

    /// With all that the options say of each other: the scheme of the formulation, and what SUGAR had.
    #[must_use]
    pub fn in_effect(&self) -> Self {
        let own = self.with_scheme(self.scheme.in_formulation(self.formulation));
        if own.as_sugar { Self { linear: true, ..own.with_centrelines() } } else { own }
    }

    /// With an option of the table at another value.
    ///
    /// # Errors
    /// A value that the option cannot have.
    pub fn with_choice(&self, option: &ModelOption, value: OptionValue) -> Result<Self, OptionError> {
        let mut changed = self.clone();
        changed.choose(option, value)?;
        Ok(changed)
    }

    /// With these parameters of the netlist at these values, behind the others.
    #[must_use]
    pub fn with_settings(&self, settings: &[(String, Setting)]) -> Self {
        let mut changed = self.clone();
        changed.set.retain(|(name, _)| settings.iter().all(|(other, _)| other != name));
        changed.set.extend_from_slice(settings);
        changed
    }

    /// Without the parameters of the netlist.
    #[must_use]
    pub fn without_settings(&self) -> Self {
        Self { set: Vec::new(), ..self.clone() }
    }

    /// Without these parameters of the netlist.
    #[must_use]
    pub fn without(&self, names: &[String]) -> Self {
        let mut changed = self.clone();
        changed.set.retain(|(name, _)| !names.contains(name));
        changed
    }

    /// With one parameter of the netlist at this number (SI).
    #[must_use]
    pub fn with_parameter(&self, name: &str, value: f64) -> Self {
        self.with_settings(&[(name.to_owned(), Setting::Number(value))])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A parameter that is set again has its last value, behind the others, and no other option changes.
    #[test]
    fn a_parameter_is_set_once() {
        let options = CompileOptions { tol: 1e-5, ..CompileOptions::default() };
        let options = options.with_parameter("w", 2e-6).with_parameter("l", 1e-4).with_parameter("w", 3e-6);
        let set = [("l", 1e-4), ("w", 3e-6)].map(|(name, value)| (name.to_owned(), Setting::Number(value)));
        assert_eq!(options.set, set);
        assert_eq!(options.without_settings(), CompileOptions::default().with_tolerance(1e-5));
    }
}
