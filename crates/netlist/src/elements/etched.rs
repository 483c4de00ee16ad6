//! Edges as etching leaves them: a layer's over-etch and the angle of its side walls.
//!
//! `overetch` e moves every edge of a part inwards, so that widths lose 2e, and gaps between facing edges and holes gain 2e. With a `sidewall` angle α
//! the width grows linearly through the thickness h, from that of the upper face by 2·h·tan α. Then
//! ```text
//! d = h·tan α      mean width m = w − 2e + d      mean gap = gap + 2e − d      least gap = mean gap − |d|
//! I about z = h·m·(m² + d²)/12      of a beam turned by a quarter about its axis (its thickness in the plane): m·h³/12·(1 − d²/(3m²))
//! ```
//! The thickness stays, and so do the places of nodes and lengths between them.

use super::super::diagnostic_sink::Reported;
use super::super::value::short;
use super::arguments::ElementSite;
use bimorph_structure::touching_distance;

/// Largest angle of a side wall against the normal (rad); a larger one is most likely in degrees.
const STEEPEST: f64 = 0.5;

/// In-plane width and thickness of the rectangle that has the area and the second moment of a section (m).
pub(super) struct EquivalentRectangle {
    pub(super) width: f64,
    pub(super) thickness: f64,
}

impl EquivalentRectangle {
    /// Of a section with the mean width `mean` that is `height` high, whose faces are wider and narrower by `lean` (m); `turned`: its height lies in the plane.
    pub(super) fn of(mean: f64, height: f64, lean: f64, turned: bool) -> Self {
        if lean == 0.0 {
            return if turned {
                Self { width: height, thickness: mean }
            } else {
                Self { width: mean, thickness: height }
            };
        }
        let width = if turned { height * (1.0 - (lean / mean).powi(2) / 3.0).sqrt() } else { mean.hypot(lean) };
        Self { width, thickness: height * mean / width }
    }
}

impl ElementSite<'_, '_> {
    /// Distance by which every edge of the layer recedes (m).
    fn overetch(&mut self) -> Result<f64, Reported> {
        self.number_or("overetch", 0.0)
    }

    /// Half of the difference of the widths of the lower and the upper face, d (m).
    pub(super) fn lean(&mut self) -> Result<f64, Reported> {
        let angle = self.number_or("sidewall", 0.0)?;
        if angle == 0.0 {
            return Ok(0.0);
        }
        if angle.abs() > STEEPEST {
            let wanted = format!("from −{STEEPEST} to {STEEPEST} rad; degrees are written `deg(2)`");
            return Err(self.out_of_range("sidewall", angle, &wanted));
        }
        Ok(self.positive("h")? * angle.tan())
    }

    /// Change of a width by etching (m).
    pub(super) fn etching(&mut self) -> Result<f64, Reported> {
        Ok(self.lean()? - 2.0 * self.overetch()?)
    }

    /// The error for a part of which etching leaves nothing.
    fn vanished(&mut self, name: &str, drawn: f64, left: f64) -> Reported {
        let by =
            if self.number("overetch").is_ok_and(|e| e.is_some_and(|e| e != 0.0)) { "overetch" } else { "sidewall" };
        let message = format!(
            "`{by}` leaves nothing of `{name}`: {} m as drawn, {} m as etched in `{}`",
            short(drawn),
            short(left),
            self.instance.name
        );
        let help = "an edge recedes by `overetch`, and a width by twice as much; the faces differ by 2·h·tan(sidewall)";
        self.sink.error("E060", self.span_of(name), message, help)
    }

    /// A positive width of the parameter `name` as etched, its mean through the thickness (m); both faces remain.
    pub(super) fn etched_if_any(&mut self, name: &str) -> Result<Option<f64>, Reported> {
        let Some(drawn) = self.positive_if_any(name)? else { return Ok(None) };
        self.etched_from(name, drawn).map(Some)
    }

    /// The same of a width that must be there.
    pub(super) fn etched(&mut self, name: &str) -> Result<f64, Reported> {
        match self.etched_if_any(name)? {
            Some(width) => Ok(width),
            None => Err(self.missing(name)),
        }
    }

    /// The same of a width as drawn, `name` its parameter.
    pub(super) fn etched_from(&mut self, name: &str, drawn: f64) -> Result<f64, Reported> {
        let (change, lean) = (self.etching()?, self.lean()?);
        if change == 0.0 && lean == 0.0 {
            return Ok(drawn);
        }
        let mean = drawn + change;
        if mean - lean.abs() <= 0.0 { Err(self.vanished(name, drawn, mean - lean.abs())) } else { Ok(mean) }
    }

    /// A width of the parameter `name` of a part whose walls stand, by over-etch alone (m).
    pub(super) fn etched_upright(&mut self, name: &str) -> Result<f64, Reported> {
        let (drawn, overetch) = (self.positive(name)?, self.overetch()?);
        let left = drawn - 2.0 * overetch;
        if left <= 0.0 { Err(self.vanished(name, drawn, left)) } else { Ok(left) }
    }

    /// A distance between facing edges that is drawn as the parameter `name`, as etched: its mean through the thickness (m).
    pub(super) fn etched_gap(&mut self, name: &str) -> Result<f64, Reported> {
        let (drawn, change, lean) = (self.positive(name)?, self.etching()?, self.lean()?);
        if change == 0.0 && lean == 0.0 {
            return Ok(drawn);
        }
        let mean = drawn - change;
        if mean - lean.abs() <= 0.0 { Err(self.vanished(name, drawn, mean - lean.abs())) } else { Ok(mean) }
    }

    /// The same where the edges are nearest, for stops.
    pub(super) fn etched_travel(&mut self, name: &str) -> Result<Option<f64>, Reported> {
        if self.positive_if_any(name)?.is_none() {
            return Ok(None);
        }
        Ok(Some(self.etched_gap(name)? - self.lean()?.abs()))
    }

    /// Mean distance of inclined walls that touch at their nearest edges, `touch` that of upright ones (m).
    pub(super) fn inclined_touch(&mut self, touch: Option<f64>, gap: f64) -> Result<Option<f64>, Reported> {
        let lean = self.lean()?.abs();
        Ok(if lean == 0.0 { touch } else { Some(touch.unwrap_or(touching_distance(gap - lean)) + lean) })
    }

    /// Refuses over-etch and inclined walls of an electrode pair that is drawn from its side.
    pub(super) fn drawn_from_above(&mut self) -> Result<(), Reported> {
        for entry in ["overetch", "sidewall"] {
            if self.number_or(entry, 0.0)? != 0.0 {
                let message = format!(
                    "`{entry}` moves edges in the plane of the layer, but `{}` is drawn from its side",
                    self.instance.name
                );
                let help = format!("write the etched width as `h`, and give `{entry}=0` here or a layer without it");
                return Err(self.sink.error("E060", self.span_of(entry), message, help));
            }
        }
        Ok(())
    }

    /// Area and polar second moment of a body as etched (m², m⁴), from those as drawn and the length of its edges: as those of a body that shrinks evenly.
    pub(super) fn etched_body(&mut self, area: f64, polar: f64) -> Result<[f64; 2], Reported> {
        let edges = self.positive_if_any("perimeter")?.unwrap_or(4.0 * area.sqrt());
        // the edge moves by half of what a width loses
        let left = area + 0.5 * self.etching()? * edges;
        if left <= 0.0 {
            return Err(self.vanished("A", area, left));
        }
        let shrunk = left / area;
        Ok([left, polar * shrunk * shrunk])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Area and second moment are those of the trapezoid, by Simpson's rule over its height (exact for cubics), upright and turned.
    #[test]
    fn equivalent_rectangles() {
        let (mean, height, lean) = (2.1e-6, 5e-6, 0.35e-6);
        let wide = |z: f64| mean + 2.0 * lean * (0.5 - z / height);
        let over = |f: &dyn Fn(f64) -> f64| {
            let n = 200;
            let h = height / f64::from(n);
            let at = |k: i32| f(f64::from(k) * h);
            (0..n / 2).map(|k| (at(2 * k) + 4.0 * at(2 * k + 1) + at(2 * k + 2)) * h / 3.0).sum::<f64>()
        };
        let area = over(&wide);
        let centre = over(&|z| z * wide(z)) / area;
        let upright = over(&|z| wide(z).powi(3) / 12.0);
        let turned = over(&|z| (z - centre).powi(2) * wide(z));
        for (second, is_turned) in [(upright, false), (turned, true)] {
            let EquivalentRectangle { width, thickness } = EquivalentRectangle::of(mean, height, lean, is_turned);
            assert!((width * thickness / area - 1.0).abs() < 1e-12);
            assert!((thickness * width.powi(3) / 12.0 / second - 1.0).abs() < 1e-9, "{is_turned}");
        }
        let plain = EquivalentRectangle::of(mean, height, 0.0, false);
        assert_eq!([plain.width, plain.thickness], [mean, height]);
    }
}
