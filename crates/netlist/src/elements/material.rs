//! Material constants of an element, from its own list and its layer.

use super::super::diagnostic_sink::Reported;
use super::super::drawing::{Fact, StructureBuilder};
use super::arguments::ElementSite;
use bimorph_structure::{GasLoss, MOLTEN, Material, SolidHeat};

/// Poisson's ratio where a layer gives none (1). Planar beams do not depend on it.
const POISSON: f64 = 0.3;
/// Film thickness of a material without damping (m); its viscosity is 0 then, so that no number depends on it.
const NO_FILM: f64 = 1.0;
/// Mean free path in air at [`ATMOSPHERE`] (m).
const FREE_PATH: f64 = 68e-9;
/// Standard atmosphere (Pa).
const ATMOSPHERE: f64 = 101_325.0;
/// Young's moduli of structural solids, from rubber to diamond (Pa).
const SOLID: std::ops::Range<f64> = 1e6..2e12;
/// Densities of solids, from foam to osmium (kg/m³).
const DENSE: std::ops::Range<f64> = 10.0..25e3;
/// Strain of a residual stress beyond the strength of any solid, including defect-free crystals (1).
const STRONGEST: f64 = 0.1;
/// Permittivity of vacuum, as SUGAR's process files round it (F/m).
pub(super) const VACUUM: f64 = 8.854e-12;

/// Parameters of a material.
const READ: [&str; 22] = [
    "strength",
    "fillet",
    "anchorquality",
    "Youngsmodulus",
    "Poisson",
    "shearmodulus",
    "crystal",
    "crystalangle",
    "C11",
    "C12",
    "C44",
    "density",
    "viscosity",
    "fluid",
    "pressure",
    "meanfreepath",
    "stress",
    "straingradient",
    "thermalexpansion",
    "ambienttemperature",
    "thermcond",
    "specificheat",
];

/// Notes the constants of beams that are those of no solid, as in GPa by mistake.
pub(crate) fn odd_layers(drawing: &mut StructureBuilder) {
    for k in 0..drawing.structure.beams.len() {
        let beam = &drawing.structure.beams[k];
        let (span, material) = (drawing.first_named[beam.a.0], &beam.material);
        let [modulus, density, stress] = [material.youngs_modulus, material.density, material.stress];
        if !SOLID.contains(&modulus) {
            drawing.note_number(Fact::OddModulus, span, modulus);
        }
        if density > 0.0 && !DENSE.contains(&density) {
            drawing.note_number(Fact::OddDensity, span, density);
        }
        if stress.abs() > STRONGEST * modulus {
            drawing.note_number(Fact::OddStress, span, stress);
        }
    }
}

impl ElementSite<'_, '_> {
    /// The material of a flexible member in the direction of the element. That of a layer is read once, unless it depends on the direction.
    pub(super) fn material(&mut self) -> Result<Material, Reported> {
        let instance = self.instance;
        if instance.arguments.given.iter().any(|argument| READ.contains(&argument.name)) {
            return self.read_material();
        }
        if let Some(known) = instance.arguments.layer.material.get() {
            return Ok(known.clone());
        }
        let noted = self.drawing.noted();
        let material = self.read_material()?;
        // a message about a layer applies to every element
        if self.drawing.noted() == noted && self.number("crystal")?.is_none() {
            let _ = instance.arguments.layer.material.set(material.clone());
        }
        Ok(material)
    }

    /// The same for a member in the direction `angle` (rad).
    pub(super) fn material_along(&mut self, material: &Material, angle: f64) -> Result<Material, Reported> {
        let material = material.clone();
        Ok(match self.wafer()? {
            Some(wafer) => wafer.turned(material, angle),
            None => material,
        })
    }

    fn read_material(&mut self) -> Result<Material, Reported> {
        let (wafer, angle) = (self.wafer()?, self.instance.rotation.angle());
        let youngs_modulus = match &wafer {
            Some(wafer) => wafer.along(angle).youngs_modulus,
            None => self.positive("Youngsmodulus")?,
        };
        let shear_modulus = self.positive_if_any("shearmodulus")?;
        let [viscosity, fluid] = self.film()?;
        let span = self.instance.span;
        if !SOLID.contains(&youngs_modulus) {
            let span = self.span_of("Youngsmodulus");
            self.drawing.note_number(Fact::OddModulus, span, youngs_modulus);
        }
        let stress = self.number_or("stress", 0.0)?;
        if stress.abs() > STRONGEST * youngs_modulus {
            let span = self.span_of("stress");
            self.drawing.note_number(Fact::OddStress, span, stress);
        }
        if self.number_or("straingradient", 0.0)? != 0.0 {
            self.drawing.note(Fact::StrainGradient, span);
        }
        let poisson = self.number_or("Poisson", POISSON)?;
        if !(poisson > -1.0 && poisson <= 0.5) {
            return Err(self.out_of_range("Poisson", poisson, "above −1 and at most 0.5"));
        }
        let material = Material {
            youngs_modulus,
            shear_modulus,
            poisson,
            density: self.density()?,
            viscosity,
            fluid,
            thermal_expansion: self.number_or("thermalexpansion", 0.0)?,
            expansion_curve: self.curve("thermalexpansion")?,
            ambient_temperature: self.ambient()?,
            stress,
            strength: self.positive_if_any("strength")?,
            fillet: self.positive_if_any("fillet")?,
            anchor_quality: self.positive_if_any("anchorquality")?,
            heat: self.solid_heat()?,
        };
        Ok(match wafer {
            Some(wafer) => wafer.turned(material, angle),
            None => material,
        })
    }

    /// Thermal constants of the solid, where both are there.
    fn solid_heat(&mut self) -> Result<Option<SolidHeat>, Reported> {
        let (conductivity, specific_heat) = (self.number("thermcond")?, self.number("specificheat")?);
        let both = conductivity.zip(specific_heat).filter(|(k, c)| *k > 0.0 && *c > 0.0);
        Ok(both.map(|(conductivity, specific_heat)| SolidHeat { conductivity, specific_heat }))
    }

    /// Keeps the ambient temperature of the first layer that has one, unless a beam has one.
    pub(super) fn note_surroundings(&mut self) -> Result<(), Reported> {
        let last = self.drawing.structure.beams.last();
        self.drawing.warm_beams |= last.is_some_and(|beam| beam.material.ambient_temperature > 0.0);
        if self.drawing.warm_beams {
            self.drawing.structure.ambient_temperature = None;
        } else if self.drawing.structure.ambient_temperature.is_none() {
            let own = self.number_or("ambienttemperature", 0.0)?;
            self.drawing.structure.ambient_temperature = (own > 0.0).then_some(own);
        }
        Ok(())
    }

    /// Ambient temperature (K); 0 by default, so that temperatures are rises.
    fn ambient(&mut self) -> Result<f64, Reported> {
        let ambient = self.number_or("ambienttemperature", 0.0)?;
        if ambient < 0.0 {
            return Err(self.out_of_range("ambienttemperature", ambient, "an absolute temperature, zero or positive"));
        }
        if ambient > MOLTEN {
            let span = self.span_of("ambienttemperature");
            self.drawing.note_number(Fact::OddRise, span, ambient);
        }
        Ok(ambient)
    }

    /// Density (kg/m³); 0 with a warning where it is missing.
    pub(super) fn density(&mut self) -> Result<f64, Reported> {
        if let Some(density) = self.number("density")? {
            if density > 0.0 && !DENSE.contains(&density) {
                let span = self.span_of("density");
                self.drawing.note_number(Fact::OddDensity, span, density);
            }
            return if density < 0.0 { self.non_negative_or("density", 0.0) } else { Ok(density) };
        }
        let span = self.instance.span;
        self.drawing.note(Fact::NoDensity, span);
        Ok(0.0)
    }

    /// Viscosity (Pa·s), with slip where there is a pressure, and thickness (m) of the gas film under a part; no viscosity when either is missing.
    pub(super) fn film(&mut self) -> Result<[f64; 2], Reported> {
        let viscosity = self.non_negative_or("viscosity", 0.0)?;
        match self.number("fluid")? {
            Some(fluid) if fluid <= 0.0 && viscosity > 0.0 => {
                Err(self.out_of_range("fluid", fluid, "positive where there is a `viscosity`"))
            }
            Some(fluid) if fluid > 0.0 && viscosity > 0.0 => {
                Ok(self.sliding(viscosity, fluid)?.map_or([0.0, NO_FILM], |viscosity| [viscosity, fluid]))
            }
            _ => Ok([0.0, NO_FILM]),
        }
    }

    /// Loss of heat through gas from a beam of that width and thickness (m); none where the gas has no conductivity.
    pub(super) fn gas_loss(&mut self, width: f64, thickness: f64) -> Result<Option<GasLoss>, Reported> {
        let conductivity = self.non_negative_or("gasconductivity", 0.0)?;
        let shape = self.positive_if_any("shapefactor")?;
        if conductivity == 0.0 {
            return Ok(None);
        }
        let distance = match self.number("fluid")? {
            Some(fluid) if fluid <= 0.0 => {
                return Err(self.out_of_range("fluid", fluid, "positive where there is a `gasconductivity`"));
            }
            Some(fluid) => fluid,
            None => return Err(self.missing("fluid")),
        };
        let shape = shape.unwrap_or_else(|| GasLoss::usual_shape(width, thickness, distance));
        Ok(Some(GasLoss { conductivity, distance, shape }))
    }

    /// A temperature (K), if it is given.
    pub(super) fn absolute(&mut self, name: &str) -> Result<Option<f64>, Reported> {
        match self.number(name)? {
            Some(temperature) if temperature < 0.0 => {
                Err(self.out_of_range(name, temperature, "an absolute temperature, zero or positive"))
            }
            temperature => Ok(temperature),
        }
    }

    /// Emissivity (1); 0 by default. A part that radiates needs an absolute ambient temperature (K).
    pub(super) fn emissivity(&mut self, ambient: f64) -> Result<f64, Reported> {
        let emissivity = self.number_or("emissivity", 0.0)?;
        if !(0.0..=1.0).contains(&emissivity) {
            return Err(self.out_of_range("emissivity", emissivity, "from 0 to 1"));
        }
        if emissivity > 0.0 && ambient == 0.0 {
            return Err(self.missing("ambienttemperature"));
        }
        Ok(emissivity)
    }

    /// Viscosity of gas that slides in a film of a thickness (m), with slip at both walls (Veijola and Turowski 2001); that of a continuum without a
    /// `pressure`, none in vacuum.
    pub(super) fn sliding(&mut self, viscosity: f64, thickness: f64) -> Result<Option<f64>, Reported> {
        let Some(pressure) = self.pressure()? else { return Ok(Some(viscosity)) };
        if pressure == 0.0 {
            return Ok(None);
        }
        let kn = self.free_path(pressure)? / thickness;
        Ok(Some(viscosity / (1.0 + 2.0 * kn + 0.2 * kn.powf(0.788) * (-0.1 * kn).exp())))
    }

    /// Pressure of the gas (Pa), if it is given.
    pub(super) fn pressure(&mut self) -> Result<Option<f64>, Reported> {
        match self.number("pressure")? {
            Some(pressure) if pressure < 0.0 => {
                Err(self.out_of_range("pressure", pressure, "zero (vacuum) or positive"))
            }
            pressure => Ok(pressure),
        }
    }

    /// Mean free path at a pressure (m).
    pub(super) fn free_path(&mut self, pressure: f64) -> Result<f64, Reported> {
        match self.number("meanfreepath")? {
            Some(free_path) if free_path < 0.0 => Err(self.out_of_range("meanfreepath", free_path, "zero or positive")),
            free_path => Ok(free_path.unwrap_or(FREE_PATH * ATMOSPHERE / pressure)),
        }
    }

    /// Permittivity (F/m).
    pub(super) fn permittivity(&mut self) -> Result<f64, Reported> {
        Ok(self.positive_if_any("permittivity")?.unwrap_or(VACUUM))
    }

    /// Prescribed mean temperature (K), if the element or its layer gives one.
    pub(super) fn temperature(&mut self, material: &Material) -> Result<Option<f64>, Reported> {
        let Some(temperature) = self.number("T")? else { return Ok(None) };
        if self.number("thermalexpansion")?.is_none() {
            return Err(self.missing("thermalexpansion"));
        }
        if let Some(curve) = &material.expansion_curve {
            let span = self.span_of("thermalexpansion");
            self.covered("thermalexpansion", curve, temperature, "temperature `T`", span)?;
        }
        if temperature < 0.0 && material.ambient_temperature > 0.0 {
            return Err(self.out_of_range("T", temperature, "an absolute temperature, zero or positive"));
        }
        if material.ambient_temperature == 0.0 && temperature != 0.0 {
            let span = self.span_of("T");
            self.drawing.note_number(Fact::AmbientZero, span, temperature);
        }
        if (temperature - material.ambient_temperature).abs() > MOLTEN {
            let span = self.span_of("T");
            self.drawing.note_number(Fact::OddRise, span, temperature);
        }
        Ok(Some(temperature))
    }
}
