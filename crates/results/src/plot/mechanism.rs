//! The mechanism as it was drawn, in grey, and deflected, in colour: one large drawing, or a grid of small ones.

use super::axis::{nice_step, quantity};
use super::labels::LabelPlaces;
use super::parts::{PixelTransform, bounds, draw_lines, draw_ports, draw_supports, outlines};
use super::shapes::{DisplacedShape, NodeDisplacement};
use super::svg::{Align, Paint, Picture};
use bimorph_structure::{NodeId, Structure};

/// Content of a figure of a mechanism.
#[derive(Debug, Clone, Copy)]
pub struct MechanismFigure<'a> {
    /// The drawn parts.
    pub structure: &'a Structure,
    /// Line above the drawing.
    pub title: &'a str,
    /// Displacement of each node by [`bimorph_structure::NodeId`]; empty: at rest only.
    pub motion: &'a [NodeDisplacement],
    /// Displacement of points along each beam, equally spaced, ends included; empty: beams are bent by their ends alone.
    pub curves: &'a [Vec<NodeDisplacement>],
    /// Mean temperature of beams (K), by name; colours the deflected beams.
    pub temperatures: &'a [(String, f64)],
    /// How large displacements are drawn.
    pub scale: DisplacementScale,
}

/// How large displacements are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DisplacementScale {
    /// Times a round factor that makes them visible; to scale where they are visible by themselves.
    Visible,
    /// Times this factor.
    Times(f64),
    /// Displacements have no size of their own (mode shapes): the largest becomes a fixed part of the picture.
    Shape,
}

const WIDTH: f64 = super::chart::WIDTH;
const MAX_HEIGHT: f64 = 640.0;
const MARGIN: f64 = 46.0;
const INK: &str = "#333333";
const REST: Paint<'static> = Paint { fill: "#d0d0d0", stroke: "#a8a8a8", width: 0.6, opacity: 1.0 };
const MOVED: &str = "#0072B2";
/// Nodes that are named in a picture: the cost of their labels is the square of their number.
const MAX_NAMES: usize = 400;
/// Fraction of the mechanism's size that the largest displacement of a mode shape becomes.
const SHAPE: f64 = 0.07;

/// A drawing with its displacements enlarged and its bounds found.
struct ScaledFigure<'a> {
    drawing: &'a MechanismFigure<'a>,
    factor: f64,
    motion: Vec<NodeDisplacement>,
    curves: Vec<Vec<NodeDisplacement>>,
    low: [f64; 2],
    high: [f64; 2],
    /// Size of support symbols (m).
    symbol: f64,
}

impl<'a> ScaledFigure<'a> {
    fn new(drawing: &'a MechanismFigure<'a>) -> Self {
        let structure = drawing.structure;
        let rest = outlines(structure, &DisplacedShape::default());
        let (low, high) = bounds(rest.iter().flat_map(|o| o.shape.iter().copied()), structure);
        let extent = (high[0] - low[0]).max(high[1] - low[1]).max(f64::MIN_POSITIVE);
        let all = drawing.motion.iter().chain(drawing.curves.iter().flatten());
        let largest = all.map(|[x, y, _]| x.hypot(*y)).fold(0.0, f64::max);
        let factor = match drawing.scale {
            DisplacementScale::Visible => {
                round_factor(largest, extent).min(open_factor(structure, drawing.motion)).max(1.0)
            }
            DisplacementScale::Times(factor) => factor,
            DisplacementScale::Shape if largest > 0.0 => SHAPE * extent / largest,
            DisplacementScale::Shape => 1.0,
        };
        let enlarge = |m: &NodeDisplacement| m.map(|x| x * factor);
        let motion: Vec<NodeDisplacement> = drawing.motion.iter().map(enlarge).collect();
        let curves: Vec<Vec<NodeDisplacement>> =
            drawing.curves.iter().map(|c| c.iter().map(enlarge).collect()).collect();
        let moved = DisplacedShape { nodes: &motion, curves: &curves, enlarged: factor != 1.0 };
        let points = rest.into_iter().chain(outlines(structure, &moved)).flat_map(|o| o.shape);
        let (low, high) = bounds(points, structure);
        let symbol = 0.022 * extent;
        let (low, high) = ([low[0] - symbol, low[1] - symbol], [high[0] + symbol, high[1] + symbol]);
        Self { drawing, factor, motion, curves, low, high, symbol }
    }

    fn size(&self) -> [f64; 2] {
        [self.high[0] - self.low[0], self.high[1] - self.low[1]]
    }

    /// Draws grey and colour.
    fn paint(&self, picture: &mut Picture, view: &PixelTransform) {
        let structure = self.drawing.structure;
        let moved = DisplacedShape { nodes: &self.motion, curves: &self.curves, enlarged: self.factor != 1.0 };
        draw_supports(picture, structure, view, self.symbol);
        draw_lines(picture, structure, &DisplacedShape::default(), view, "#b4b4b4");
        for outline in outlines(structure, &DisplacedShape::default()) {
            picture.polygon(&view.all(&outline.shape), REST);
        }
        if self.motion.is_empty() {
            return;
        }
        let temperatures = self.drawing.temperatures;
        let hottest = hottest(temperatures).map_or(f64::NEG_INFINITY, |(_, t)| *t);
        let coldest = coldest(self.drawing);
        draw_lines(picture, structure, &moved, view, MOVED);
        for outline in outlines(structure, &moved) {
            let heat = temperatures.iter().find(|(name, _)| *name == outline.name);
            let colour = heat.map_or(MOVED.to_owned(), |(_, t)| warm(*t, coldest, hottest));
            let paint = Paint { fill: &colour, stroke: &colour, width: 0.8, opacity: 0.82 };
            picture.polygon(&view.all(&outline.shape), paint);
        }
    }
}

/// Largest round factor that closes no gap of the drawing: gaps are drawn by the scale of displacements. Infinite without gaps.
fn open_factor(structure: &Structure, motion: &[NodeDisplacement]) -> f64 {
    let moved = |node: NodeId, axis: [f64; 2]| motion.get(node.0).map_or(0.0, |[x, y, _]| axis[0] * x + axis[1] * y);
    let plates = structure.plate_gaps.iter().map(|gap| (gap.gap, moved(gap.a, gap.axis) - moved(gap.b, gap.axis)));
    let beams = structure.beam_gaps.iter().flat_map(|gap| {
        let normal = gap.angle + gap.side * std::f64::consts::FRAC_PI_2;
        let (axis, [a, b, c, d]) = ([normal.cos(), normal.sin()], gap.nodes);
        [(a, c), (b, d)].map(|(upper, lower)| (gap.gap, moved(lower, axis) - moved(upper, axis)))
    });
    let stops = structure.stops.iter().flat_map(|stop| {
        let way = moved(stop.a, stop.axis) - stop.b.map_or(0.0, |b| moved(b, stop.axis));
        [(stop.ways[0], way), (stop.ways[1], -way)].into_iter().filter_map(|(gap, way)| Some((gap?, way)))
    });
    let closing = plates.chain(beams).chain(stops).filter(|(gap, way)| *way > 1e-3 * gap);
    let most = closing.map(|(gap, way)| gap / way).fold(f64::INFINITY, f64::min);
    if most.is_infinite() { most } else { round_down(most) }
}

/// 1, 2 or 5 times a power of ten, not above `most`.
fn round_down(most: f64) -> f64 {
    let found = [1.0, 0.5, 0.4, 0.2].iter().map(|s| nice_step(s * most)).find(|f| *f <= most * (1.0 + 1e-9));
    found.filter(|f| f.is_finite()).unwrap_or(1.0)
}

fn hottest(temperatures: &[(String, f64)]) -> Option<&(String, f64)> {
    temperatures.iter().max_by(|a, b| a.1.total_cmp(&b.1))
}

/// The lowest temperature there is: that of the surroundings, where nothing is colder (K).
fn coldest(drawing: &MechanismFigure<'_>) -> f64 {
    let ambient = drawing.structure.beams.iter().filter(|b| b.heater.is_some() || b.temperature.is_some());
    let ambient = ambient.map(|b| b.material.ambient_temperature);
    drawing.temperatures.iter().map(|(_, t)| *t).chain(ambient).fold(f64::INFINITY, f64::min)
}

/// Draws a mechanism.
pub fn draw(drawing: &MechanismFigure<'_>) -> Picture {
    let prepared = ScaledFigure::new(drawing);
    let [across, up] = prepared.size();
    let scale = ((WIDTH - 2.0 * MARGIN) / across).min(MAX_HEIGHT / up);
    let height = up * scale;
    let mut picture = Picture::new(WIDTH, height + 116.0);
    let left = (WIDTH - across * scale) / 2.0;
    let view = PixelTransform { low: prepared.low, scale, bottom: 52.0 + height, left };
    picture.text(MARGIN, 24.0, 15.0, Align::Start, INK, drawing.title);
    prepared.paint(&mut picture, &view);
    draw_ports(&mut picture, drawing.structure, &view);
    legend(&mut picture, drawing, prepared.factor, hottest(drawing.temperatures), scale, height + 76.0);
    picture
}

/// Draws a mechanism at rest with the names of its nodes; says how many found no room.
pub fn named(title: &str, structure: &Structure) -> Picture {
    let drawing = MechanismFigure {
        structure,
        title,
        motion: &[],
        curves: &[],
        temperatures: &[],
        scale: DisplacementScale::Visible,
    };
    let prepared = ScaledFigure::new(&drawing);
    let [across, up] = prepared.size();
    let scale = ((WIDTH - 2.0 * MARGIN) / across).min(MAX_HEIGHT / up);
    let height = up * scale;
    let mut picture = Picture::new(WIDTH, height + 116.0);
    let view = PixelTransform { low: prepared.low, scale, bottom: 52.0 + height, left: (WIDTH - across * scale) / 2.0 };
    picture.text(MARGIN, 24.0, 15.0, Align::Start, INK, title);
    prepared.paint(&mut picture, &view);
    let drawn: Vec<_> = structure.nodes.iter().filter(|node| node.mechanical && !node.name.is_empty()).collect();
    let mut places = LabelPlaces::new([4.0, 34.0, WIDTH - 4.0, height + 66.0]);
    let shown = &drawn[..drawn.len().min(MAX_NAMES)];
    shown.iter().for_each(|node| places.keep_free(view.at(node.position), 3.0));
    let mut left_out = drawn.len() - shown.len();
    for node in shown {
        let [x, y] = view.at(node.position);
        picture.circle(x, y, 2.5, Paint { fill: "#ffffff", stroke: MOVED, width: 1.4, opacity: 1.0 });
        match places.place([x, y], 12.0, &node.name) {
            Some(place) => picture.label(place.x, place.y, 12.0, place.align, MOVED, &node.name),
            None => left_out += 1,
        }
    }
    for port in &structure.ports {
        let Some(node) = structure.nodes.get(port.plus.0).filter(|node| node.mechanical) else { continue };
        let [x, y] = view.at(node.position);
        picture.circle(x, y, 4.5, Paint { fill: "none", stroke: "#D55E00", width: 2.0, opacity: 1.0 });
        let text = format!("port {}", port.name);
        if let Some(place) = places.place([x, y], 12.0, &text) {
            picture.label(place.x, place.y, 12.0, place.align, "#D55E00", &text);
        }
    }
    let y = height + 76.0;
    let length = nice_step(110.0 / scale / 2.0);
    picture.polyline(&[[MARGIN, y], [MARGIN + length * scale, y]], Paint::line(INK, 3.0));
    picture.text(MARGIN, y + 17.0, 12.0, Align::Start, INK, &round_length(length));
    let note = match left_out {
        0 => format!("{} nodes", drawn.len()),
        _ => format!("{} nodes, {left_out} names without room", drawn.len()),
    };
    picture.text(WIDTH - MARGIN, y + 17.0, 12.0, Align::End, INK, &note);
    picture
}

/// Background of a mechanism.
#[derive(Debug, Clone, Default)]
pub struct Ground {
    /// Contours of a layout (m).
    pub drawn: Vec<Vec<[f64; 2]>>,
    /// Contours that no part of the mechanism covers (m).
    pub foreign: Vec<Vec<[f64; 2]>>,
}

/// Draws a mechanism over the layout that it came from: the layout pale, the mechanism in blue, what is in no part of it red.
pub fn over(title: &str, structure: &Structure, ground: &Ground) -> Picture {
    let rest = outlines(structure, &DisplacedShape::default());
    let points = rest.iter().flat_map(|o| &o.shape).chain(ground.drawn.iter().flatten()).copied();
    let (low, high) = bounds(points, structure);
    let (across, up) = ((high[0] - low[0]).max(f64::MIN_POSITIVE), (high[1] - low[1]).max(f64::MIN_POSITIVE));
    let scale = ((WIDTH - 2.0 * MARGIN) / across).min(MAX_HEIGHT / up);
    let height = up * scale;
    let mut picture = Picture::new(WIDTH, height + 116.0);
    let view = PixelTransform { low, scale, bottom: 52.0 + height, left: (WIDTH - across * scale) / 2.0 };
    picture.text(MARGIN, 24.0, 15.0, Align::Start, INK, title);
    for contour in &ground.drawn {
        picture.polygon(&view.all(contour), Paint { fill: "#f0e2b8", stroke: "#c9b06b", width: 0.5, opacity: 1.0 });
    }
    for outline in &rest {
        picture.polygon(&view.all(&outline.shape), Paint { fill: MOVED, stroke: MOVED, width: 0.8, opacity: 0.45 });
    }
    draw_supports(&mut picture, structure, &view, 0.012 * across.max(up));
    draw_lines(&mut picture, structure, &DisplacedShape::default(), &view, MOVED);
    for contour in &ground.foreign {
        picture.polygon(&view.all(contour), Paint { fill: "#D55E00", stroke: "#D55E00", width: 1.2, opacity: 0.8 });
    }
    draw_ports(&mut picture, structure, &view);
    let y = height + 76.0;
    let length = nice_step(110.0 / scale / 2.0);
    picture.polyline(&[[MARGIN, y], [MARGIN + length * scale, y]], Paint::line(INK, 3.0));
    picture.text(MARGIN, y + 17.0, 12.0, Align::Start, INK, &round_length(length));
    let red = if ground.foreign.is_empty() { "nothing was left over" } else { "red: in no part of it" };
    let legend = format!("pale: the layout  ·  blue: the mechanism  ·  {red}");
    picture.text(WIDTH - MARGIN, y + 17.0, 12.0, Align::End, INK, &legend);
    picture
}

/// Draws several states of mechanisms in a grid, each under its own title, all to one scale of length.
pub fn grid(title: &str, drawings: &[MechanismFigure<'_>]) -> Picture {
    let mut prepared: Vec<ScaledFigure<'_>> = drawings.iter().map(ScaledFigure::new).collect();
    // each at the same place of its cell
    for i in 0..2 {
        let low = prepared.iter().map(|p| p.low[i]).fold(f64::INFINITY, f64::min);
        let high = prepared.iter().map(|p| p.high[i]).fold(f64::NEG_INFINITY, f64::max);
        prepared.iter_mut().for_each(|p| (p.low[i], p.high[i]) = (low, high));
    }
    let most = |i: usize| prepared.iter().map(|p| p.size()[i]).fold(f64::MIN_POSITIVE, f64::max);
    let (across, up) = (most(0), most(1));
    // wide mechanisms under each other, tall ones beside each other
    let columns = if across > 2.2 * up { 2 } else { 3 }.min(prepared.len().max(1));
    let (gap, head) = (18.0, 26.0);
    let room = WIDTH - 2.0 * MARGIN - gap * (columns as f64 - 1.0);
    let cell = room / columns as f64;
    let scale = (cell / across).min(0.75 * MAX_HEIGHT / up);
    let height = up * scale;
    let rows = prepared.len().div_ceil(columns);
    let pitch = head + height + gap;
    let mut picture = Picture::new(WIDTH, 52.0 + rows as f64 * pitch + 40.0);
    picture.text(MARGIN, 24.0, 15.0, Align::Start, INK, title);
    for (k, prepared) in prepared.iter().enumerate() {
        let x = MARGIN + (k % columns) as f64 * (cell + gap);
        let y = 48.0 + (k / columns) as f64 * pitch;
        let [wide, tall] = prepared.size();
        let left = x + (cell - wide * scale) / 2.0;
        let bottom = y + head + (height + tall * scale) / 2.0;
        picture.text(x + cell / 2.0, y + 13.0, 13.0, Align::Middle, INK, prepared.drawing.title);
        prepared.paint(&mut picture, &PixelTransform { low: prepared.low, scale, bottom, left });
    }
    if let Some(first) = drawings.first() {
        legend(&mut picture, first, prepared[0].factor, None, scale, 52.0 + rows as f64 * pitch + 6.0);
    }
    picture
}

/// 1 where the motion shows by itself, else the largest round factor that keeps the largest one below 6 % of the picture.
fn round_factor(largest: f64, extent: f64) -> f64 {
    if largest == 0.0 || !largest.is_finite() || largest > 0.03 * extent {
        return 1.0;
    }
    round_down(0.06 * extent / largest)
}

fn legend(
    picture: &mut Picture,
    drawing: &MechanismFigure<'_>,
    factor: f64,
    hot: Option<&(String, f64)>,
    scale: f64,
    y: f64,
) {
    let length = nice_step(110.0 / scale / 2.0);
    let x = MARGIN;
    picture.polyline(&[[x, y], [x + length * scale, y]], Paint::line(INK, 3.0));
    picture.text(x, y + 17.0, 12.0, Align::Start, INK, &round_length(length));
    let mut parts = vec!["grey: as drawn".to_owned()];
    if drawing.scale == DisplacementScale::Shape {
        parts.push("colour: shape of the mode".to_owned());
    } else if !drawing.motion.is_empty() {
        let times = if factor == 1.0 { "to scale".to_owned() } else { format!("displacements × {factor}") };
        parts.push(format!("colour: deflected, {times}"));
        let largest = drawing.motion.iter().map(|[x, y, _]| x.hypot(*y)).fold(0.0, f64::max);
        parts.push(format!("largest {}", quantity(largest, "m")));
    }
    if let Some((name, t)) = hot.filter(|(_, t)| *t > coldest(drawing)) {
        parts.push(format!("hottest: {name} {}", quantity(*t, "K")));
        colour_bar(picture, [x + length * scale + 36.0, y - 6.0], [coldest(drawing), *t]);
    }
    picture.text(WIDTH - MARGIN, y + 17.0, 12.0, Align::End, INK, &parts.join("  ·  "));
}

/// The colours between two temperatures (K), with both beside them.
fn colour_bar(picture: &mut Picture, [x, y]: [f64; 2], [cold, hot]: [f64; 2]) {
    const STEPS: usize = 24;
    const STEP: f64 = 5.0;
    let left = quantity(cold, "K");
    let x = x + 6.6 * left.chars().count() as f64 + 6.0;
    picture.text(x - 6.0, y + 4.0, 11.0, Align::End, INK, &left);
    for k in 0..STEPS {
        let colour = warm(k as f64, 0.0, (STEPS - 1) as f64);
        picture.rectangle(x + STEP * k as f64, y - 4.0, STEP, 9.0, Paint::fill(&colour));
    }
    picture.text(x + STEP * STEPS as f64 + 6.0, y + 4.0, 11.0, Align::Start, INK, &quantity(hot, "K"));
}

fn round_length(length: f64) -> String {
    let (factor, prefix) = super::axis::prefix(length);
    format!("{} {prefix}m", (length / factor * 1e3).round() / 1e3)
}

/// Blue at the coldest to red at the hottest.
fn warm(t: f64, coldest: f64, hottest: f64) -> String {
    let s = if hottest > coldest { (t - coldest) / (hottest - coldest) } else { 0.0 };
    let mix = |cold: f64, hot: f64| (cold + s * (hot - cold)).round() as u8;
    format!("#{:02x}{:02x}{:02x}", mix(0.0, 213.0), mix(114.0, 60.0), mix(178.0, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bimorph_structure::{Link, Node};

    /// Small motion is exaggerated by a round factor that the picture states; large motion is shown to scale.
    #[test]
    fn the_factor_is_printed() {
        let node = |x| Node { name: String::new(), position: [x, 0.0], mechanical: true, electrical: false };
        let mut structure = Structure { nodes: vec![node(0.0), node(100e-6)], ..Structure::default() };
        structure.links.push(Link { name: "l".into(), a: NodeId(0), b: NodeId(1) });
        let picture = |v: f64| {
            let motion = [[0.0; 3], [0.0, v, 0.0]];
            let drawing = MechanismFigure {
                structure: &structure,
                title: "t",
                motion: &motion,
                curves: &[],
                temperatures: &[],
                scale: DisplacementScale::Visible,
            };
            draw(&drawing).to_svg()
        };
        assert!(picture(0.3e-6).contains("displacements × 20"));
        assert!(picture(10e-6).contains("to scale"));
        assert!(picture(0.0).contains("to scale"));
    }
}
