//! A picture as a list of SVG elements: just the few shapes that charts and drawings need.

use std::fmt::Write;

/// Font of every text; the first is the one that PNG pictures carry with them.
const FONT: &str = "DejaVu Sans, Verdana, sans-serif";

/// A picture under construction. Coordinates are pixels from the upper left corner.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Width (px).
    pub width: f64,
    /// Height (px).
    pub height: f64,
    body: String,
}

/// Where a text stands relative to its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// The text starts at the point.
    Start,
    /// The text is centred on the point.
    Middle,
    /// The text ends at the point.
    End,
}

/// How a shape is painted.
#[derive(Debug, Clone, Copy)]
pub struct Paint<'a> {
    /// Colour of the inside, or "none".
    pub fill: &'a str,
    /// Colour of the outline, or "none".
    pub stroke: &'a str,
    /// Width of the outline (px).
    pub width: f64,
    /// 0 (invisible) to 1 (opaque).
    pub opacity: f64,
}

impl<'a> Paint<'a> {
    /// A line of that colour and width.
    pub fn line(stroke: &'a str, width: f64) -> Self {
        Self { fill: "none", stroke, width, opacity: 1.0 }
    }

    /// A filled shape without outline.
    pub fn fill(fill: &'a str) -> Self {
        Self { fill, stroke: "none", width: 0.0, opacity: 1.0 }
    }

    fn attributes(&self) -> String {
        let mut text = format!("fill=\"{}\" stroke=\"{}\"", self.fill, self.stroke);
        if self.stroke != "none" {
            let _ = write!(text, " stroke-width=\"{}\" stroke-linejoin=\"round\"", trim(self.width));
        }
        if self.opacity < 1.0 {
            let _ = write!(text, " opacity=\"{}\"", trim(self.opacity));
        }
        text
    }
}

impl Picture {
    /// An empty picture of that size (px).
    pub fn new(width: f64, height: f64) -> Self {
        Self { width, height, body: String::new() }
    }

    /// Puts another picture into this one with its upper left corner at (x, y).
    pub fn place(&mut self, other: &Self, x: f64, y: f64) {
        let _ = writeln!(self.body, "<g transform=\"translate({} {})\">\n{}</g>", trim(x), trim(y), other.body);
    }

    /// An axis-aligned rectangle.
    pub fn rectangle(&mut self, x: f64, y: f64, width: f64, height: f64, paint: Paint<'_>) {
        let _ = writeln!(
            self.body,
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" {}/>",
            trim(x),
            trim(y),
            trim(width),
            trim(height),
            paint.attributes()
        );
    }

    /// A line through points.
    pub fn polyline(&mut self, points: &[[f64; 2]], paint: Paint<'_>) {
        self.shape("polyline", points, paint);
    }

    /// A closed shape through points.
    pub fn polygon(&mut self, points: &[[f64; 2]], paint: Paint<'_>) {
        self.shape("polygon", points, paint);
    }

    fn shape(&mut self, element: &str, points: &[[f64; 2]], paint: Paint<'_>) {
        let list: Vec<String> = points.iter().map(|[x, y]| format!("{},{}", trim(*x), trim(*y))).collect();
        let _ = writeln!(self.body, "<{element} points=\"{}\" {}/>", list.join(" "), paint.attributes());
    }

    /// A circle.
    pub fn circle(&mut self, x: f64, y: f64, radius: f64, paint: Paint<'_>) {
        let _ = writeln!(
            self.body,
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" {}/>",
            trim(x),
            trim(y),
            trim(radius),
            paint.attributes()
        );
    }

    /// A line of text with its base line at y, of that size (px) and colour.
    pub fn text(&mut self, x: f64, y: f64, size: f64, align: Align, colour: &str, text: &str) {
        let anchor = match align {
            Align::Start => "start",
            Align::Middle => "middle",
            Align::End => "end",
        };
        let _ = writeln!(
            self.body,
            "<text x=\"{}\" y=\"{}\" font-size=\"{}\" text-anchor=\"{anchor}\" fill=\"{colour}\">{}</text>",
            trim(x),
            trim(y),
            trim(size),
            escape(text)
        );
    }

    /// A line of text that stays readable over a drawing: with a white edge, which is drawn as a text below it, since not every viewer knows
    /// `paint-order`.
    pub fn label(&mut self, x: f64, y: f64, size: f64, align: Align, colour: &str, text: &str) {
        let _ = write!(self.body, "<g stroke=\"#ffffff\" stroke-width=\"3\">");
        self.text(x, y, size, align, "#ffffff", text);
        let _ = writeln!(self.body, "</g>");
        self.text(x, y, size, align, colour, text);
    }

    /// The finished document, with a white ground.
    pub fn to_svg(&self) -> String {
        let (w, h) = (trim(self.width), trim(self.height));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
             font-family=\"{FONT}\">\n<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n{}</svg>\n",
            self.body
        )
    }
}

/// A coordinate with two decimals at most; what is not finite becomes 0, since SVG has no word for it.
fn trim(x: f64) -> String {
    let text = format!("{:.2}", if x.is_finite() { x } else { 0.0 });
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Text with the characters that XML keeps for itself spelled out.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names from a netlist cannot break the document, and numbers stay finite and short.
    #[test]
    fn text_is_escaped_and_numbers_are_short() {
        let mut picture = Picture::new(10.0, 10.0);
        picture.text(f64::NAN, -0.001, 1.0 / 3.0, Align::Start, "#000", "a<b & \"c\"");
        let svg = picture.to_svg();
        assert!(svg.contains("x=\"0\" y=\"0\" font-size=\"0.33\""), "{svg}");
        assert!(svg.contains("a&lt;b &amp; &quot;c&quot;"), "{svg}");
    }
}
