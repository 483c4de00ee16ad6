//! Beams whose section is no plain rectangle, as beams of the rectangle with the same area and second moment about z.

use super::super::diagnostic_sink::Reported;
use super::super::drawing::Fact;
use super::arguments::ElementSite;

/// Fraction of the bending stiffness that `softjointlr` and `hinge3` retain (1).
const SOFT: f64 = 1e-2;

impl ElementSite<'_, '_> {
    /// Adds a straight beam whose section has `area` (m²) and the second moment `second` (m⁴) about z.
    fn add_equivalent(&mut self, area: f64, second: f64) -> Result<(), Reported> {
        self.drawing.note(Fact::OutOfPlane, self.instance.span);
        let length = self.positive("l")?;
        self.side()?;
        let width = (12.0 * second / area).sqrt();
        let mut beam = self.beam(self.name(), [self.node(0), self.node(1)], width, Some(length))?;
        beam.width = width;
        beam.thickness = area / width;
        self.drawing.add_beam(self.instance.span, beam, true);
        Ok(())
    }
}

/// trapezoidalbeam: the width goes from `wbottom` to `wtop` through the thickness.
pub(super) fn trapezoidal(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let (bottom, top) = (site.etched_upright("wbottom")?, site.etched_upright("wtop")?);
    let height = site.positive("h")?;
    site.drawing.note(Fact::Trapezoid, site.instance.span);
    // ∫ w(z)³/12 dz of a width that is linear in z
    let second = height / 48.0 * (bottom + top) * (bottom * bottom + top * top);
    site.add_equivalent(0.5 * height * (bottom + top), second)
}

/// softjointlr, hinge3: a beam whose second moment is a hundredth.
pub(super) fn soft_joint(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let (width, height, lean) = (site.etched("w")?, site.positive("h")?, site.lean()?);
    let second = if lean == 0.0 { width.powi(3) } else { width * (width * width + lean * lean) };
    site.add_equivalent(width * height, SOFT * height * second / 12.0)
}
