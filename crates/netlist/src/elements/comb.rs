//! Comb drives: SUGAR's comb2d at a fixed voltage, and comb2de between two electrical nodes.

use super::super::diagnostic_sink::Reported;
use super::arguments::ElementSite;
use bimorph_structure::{Comb, Fringe, GapVoltage, Impact, touching_distance};

impl ElementSite<'_, '_> {
    /// Viscosity of the gas that slides in gaps of a width (m): 0 without a `pressure`.
    fn between_fingers(&mut self, gap: f64) -> Result<f64, Reported> {
        if self.pressure()?.is_none() {
            return Ok(0.0);
        }
        let viscosity = self.non_negative_or("viscosity", 0.0)?;
        Ok(self.sliding(viscosity, gap)?.unwrap_or(0.0))
    }

    /// Misalignment of the fingers in gaps of a width that touch at a distance, and distance of the substrate (m), 0 without one.
    fn place_of_fingers(&mut self, gap: f64, touch: Option<f64>, width: f64) -> Result<(f64, f64), Reported> {
        let misalignment = self.number_or("misalign", 0.0)?;
        if misalignment.abs() > gap - touch.unwrap_or(touching_distance(gap)) {
            return Err(self.out_of_range(
                "misalign",
                misalignment,
                "so far that the fingers do not touch, within ± gap",
            ));
        }
        let substrate = self.positive_if_any("substrate")?.unwrap_or(0.0);
        if substrate > 0.0 && width == 0.0 {
            return Err(self.missing("w"));
        }
        Ok((misalignment, substrate))
    }

    fn comb(&mut self, finite: bool, parasitic: f64, voltage: GapVoltage) -> Result<(), Reported> {
        self.warn_of_coincident_ends();
        let angle = self.direction(self.instance.rotation)?;
        let (gaps, gap, height) = (self.positive("N")?, self.etched_gap("gap")?, self.positive("h")?);
        let (overlap, finger) = (self.non_negative_or("l", 0.0)?, self.positive("L")?);
        if overlap > finger {
            let span = self.span_of("l");
            let message = "the overlap `l` of a comb is longer than its fingers `L`".to_owned();
            return Err(self.sink.error("E060", span, message, ""));
        }
        let width = self.etched_if_any("w")?.unwrap_or(0.0);
        let permittivity = self.permittivity()?;
        let law = if finite { self.fringe()? } else { None };
        if width == 0.0 && law == Some(Fringe::Exact) && self.is_given("fringe") {
            return Err(self.missing("w"));
        }
        let offset = self.offset()?;
        let (touch, impact) = if finite { (self.touch(gap)?, self.impact()?) } else { (None, Impact::default()) };
        let (misalignment, substrate) = if finite { self.place_of_fingers(gap, touch, width)? } else { (0.0, 0.0) };
        let sliding = self.between_fingers(gap)? * gaps * height / gap;
        let axis = [angle.cos(), angle.sin()];
        let (a, b) = (self.node(0), self.node(1));
        let apart = 2.0 * finger - overlap;
        self.drawing.place(self.instance.span, &[a, b], &[[0.0; 2], [apart * axis[0], apart * axis[1]]]);
        // tips recede on both sides, and so does the base behind them
        let overlap = overlap + self.etching()?;
        self.drawing.structure.combs.push(Comb {
            name: self.name(),
            a,
            b,
            axis,
            gaps,
            gap,
            height,
            overlap,
            permittivity,
            parasitic,
            finger: [finger, width],
            law,
            misalignment,
            substrate,
            sliding,
            touch,
            impact,
            finite,
            offset,
            voltage,
        });
        Ok(())
    }
}

pub(super) fn comb2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let voltage = GapVoltage::Fixed(site.required("V")?);
    site.comb(false, 0.0, voltage)
}

pub(super) fn comb2de(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let parasitic = site.non_negative_or("Cp", 0.0)?;
    let voltage = site.across(0, 1);
    site.comb(true, parasitic, voltage)
}
