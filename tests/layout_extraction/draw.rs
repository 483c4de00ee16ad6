//! Draws mechanisms: boxes with corners closed by half a width, turned by any angle, rounded to the grid.

use bimorph::layout::drawing::{FlatLayout, GridPoint, Label, Polygon};

/// Database units in a micrometre.
const GRID: f64 = 1000.0;

/// A drawing in the making; lengths in micrometres.
#[derive(Debug, Clone)]
pub(crate) struct Sheet {
    drawing: FlatLayout,
    /// Everything is turned by this (rad) and then moved.
    angle: f64,
    shift: [f64; 2],
}

impl Sheet {
    pub(crate) fn new(degrees: f64, shift: [f64; 2]) -> Self {
        let drawing =
            FlatLayout { unit_m: 1e-6 / GRID, source: "sheet".into(), top: "TOP".into(), ..FlatLayout::default() };
        Self { drawing, angle: degrees.to_radians(), shift }
    }

    fn point(&self, [x, y]: [f64; 2]) -> GridPoint {
        let (s, c) = self.angle.sin_cos();
        [c * x - s * y + self.shift[0], s * x + c * y + self.shift[1]].map(|v| (v * GRID).round() as i32)
    }

    pub(crate) fn polygon(&mut self, layer: &str, corners: &[[f64; 2]]) {
        let contour = corners.iter().map(|p| self.point(*p)).collect();
        self.drawing.layers.entry(layer.into()).or_default().push(Polygon::from_contour(contour));
    }

    pub(crate) fn rectangle(&mut self, layer: &str, [x0, y0]: [f64; 2], [x1, y1]: [f64; 2]) {
        self.polygon(layer, &[[x0, y0], [x1, y0], [x1, y1], [x0, y1]]);
    }

    /// A beam from `a` to `b` with widths at both, led on by `past` at both ends.
    pub(crate) fn beam(&mut self, a: [f64; 2], b: [f64; 2], width: [f64; 2], past: [f64; 2]) {
        let long = (b[0] - a[0]).hypot(b[1] - a[1]);
        let (u, n) = ([(b[0] - a[0]) / long, (b[1] - a[1]) / long], [-(b[1] - a[1]) / long, (b[0] - a[0]) / long]);
        let at = |p: [f64; 2], s: f64, w: f64| [p[0] + s * u[0] + w * n[0], p[1] + s * u[1] + w * n[1]];
        let [w0, w1] = width.map(|w| 0.5 * w);
        let corners = [at(a, -past[0], -w0), at(b, past[1], -w1), at(b, past[1], w1), at(a, -past[0], w0)];
        self.polygon("POLY1", &corners);
    }

    /// A pad with an anchor inside.
    pub(crate) fn pad(&mut self, low: [f64; 2], high: [f64; 2]) {
        self.rectangle("POLY1", low, high);
        self.rectangle("ANCHOR1", low.map(|x| x + 2.0), high.map(|x| x - 2.0));
    }

    #[allow(dead_code)]
    pub(crate) fn label(&mut self, text: &str, at: [f64; 2]) {
        let at = self.point(at);
        self.drawing.labels.push(Label { layer: "POLY1".into(), text: text.into(), at });
    }

    pub(crate) fn drawing(&self) -> &FlatLayout {
        &self.drawing
    }
}
