//! Electrostatic gaps between facing beams (SUGAR's gap2d family) and between lumped plates.

use super::super::diagnostic_sink::Reported;
use super::super::drawing::Fact;
use super::super::value::short;
use super::arguments::ElementSite;
use super::material::VACUUM;
use bimorph_structure::{
    BeamGap, ElectrodeShape, FacingGas, FilmSlit, Fringe, GapVoltage, IMPACT_SPEEDS, Impact, InsulatingLayer,
    MAX_FILM_STATES, MIN_RESTITUTION, NodeId, Perforation, PlateGap, Resistor,
};

/// States of gas that compresses, unless a netlist says otherwise: |Z| of a square within 0.4 % to ten times its first corner, of a rectangle of 1:2 to three times.
const FILM_STATES: f64 = 4.0;
/// Mean free path over the gap to which the effective viscosity is known to 5 % (Veijola and others 1995) (1).
const MAX_FREE_PATHS: f64 = 880.0;
/// Permittivity over that of vacuum below which a netlist cancels SUGAR's factor on the fringe field by hand (1).
const REDUCED: f64 = 1.0 - 1e-3;

impl ElementSite<'_, '_> {
    /// Widths of the upper and the lower beam (m): `w1` and `w2`, or `w` for both.
    fn widths(&mut self) -> Result<[f64; 2], Reported> {
        let both = self.etched_if_any("w")?;
        let mut widths = [0.0; 2];
        for (width, name) in widths.iter_mut().zip(["w1", "w2"]) {
            *width = match (self.etched_if_any(name)?, both) {
                (Some(w), _) | (None, Some(w)) => w,
                (None, None) => return Err(self.missing(name)),
            };
        }
        Ok(widths)
    }

    /// Distance at which electrodes drawn `gap` apart touch (m), if it is given.
    pub(super) fn touch(&mut self, gap: f64) -> Result<Option<f64>, Reported> {
        let touch = self.positive_if_any("touch")?;
        if let Some(touch) = touch
            && touch >= gap
        {
            let message = format!("`touch` is {} m, but the parts are drawn only {} m apart", short(touch), short(gap));
            let help = "give a distance below `gap`: the thickness of the insulation, or the height of the bumps";
            return Err(self.sink.error("E060", self.span_of("touch"), message, help));
        }
        Ok(touch)
    }

    /// Insulating layer of the relative permittivity `er` on an electrode, and the touching distance: both are the thickness `td` where that alone is given.
    fn insulation(&mut self, gap: f64) -> Result<(Option<InsulatingLayer>, Option<f64>), Reported> {
        let touch = self.touch(gap)?;
        let thickness = self.positive_if_any("td")?;
        let Some(permittivity) = self.positive_if_any("er")? else {
            return if thickness.is_some() { Err(self.missing("er")) } else { Ok((None, touch)) };
        };
        if permittivity < 1.0 {
            return Err(self.out_of_range("er", permittivity, "1 or more"));
        }
        let Some(thickness) = thickness.or(touch) else { return Err(self.missing("td")) };
        if thickness >= gap || touch.is_some_and(|touch| touch < thickness * (1.0 - 1e-9)) {
            let message = format!("the insulation `td` is {} m thick, more than `touch` or the gap", short(thickness));
            let help = "give `td` below `gap`; parts touch at `td`, or at `touch` where bumps keep them farther apart";
            return Err(self.sink.error("E060", self.span_of("td"), message, help));
        }
        Ok((Some(InsulatingLayer { thickness, permittivity }), touch.or(Some(thickness))))
    }

    /// Impact losses, where they are given.
    pub(super) fn impact(&mut self) -> Result<Impact, Reported> {
        let within = |site: &mut Self, name: &str, [least, most]: [f64; 2], help: &str| match site.number(name)? {
            Some(x) if !(least..=most).contains(&x) => {
                let message = format!("`{name}` is {x:e}, expected {least:e} to {most:e}");
                Err(site.sink.error("E060", site.span_of(name), message, help))
            }
            x => Ok(x),
        };
        let elastic = "1 is elastic contact; the default is 0.5 at the speed `speed` [m/s]";
        let restitution = within(self, "restitution", [MIN_RESTITUTION, 1.0], elastic)?;
        let speed =
            within(self, "speed", IMPACT_SPEEDS, "a speed of impact [m/s]; by default it is found from statics")?;
        Ok(Impact { restitution, speed })
    }

    /// Offset voltage of trapped charge (V).
    pub(super) fn offset(&mut self) -> Result<f64, Reported> {
        Ok(self.number("voffset")?.unwrap_or(0.0))
    }

    /// Law of the fringe field, where the element or its layer names one.
    pub(super) fn fringe(&mut self) -> Result<Option<Fringe>, Reported> {
        self.word("fringe", &Fringe::NAMES)
    }

    /// Gas between parts drawn `gap` apart that face each other in rectangles with these sides (m), of an area in all (m²): where there is a `pressure` and a `viscosity`.
    fn gas(&mut self, sides: Option<[f64; 2]>, area: f64, gap: f64) -> Result<Option<FacingGas>, Reported> {
        let closed = self.positive_if_any("filmgap")?;
        if let Some(closed) = closed
            && closed >= gap
        {
            return Err(self.out_of_range("filmgap", closed, "below `gap`"));
        }
        let Some(pressure) = self.pressure()?.filter(|pressure| *pressure > 0.0) else { return Ok(None) };
        let free_path = self.free_path(pressure)?;
        if self.number("viscosity")?.is_none() {
            return Err(self.missing("viscosity"));
        }
        let viscosity = self.non_negative_or("viscosity", 0.0)?;
        if viscosity > 0.0 && free_path > MAX_FREE_PATHS * gap {
            let message = format!(
                "the mean free path of the gas in `{}` is {:.0} gaps; the law of the film holds for less than {MAX_FREE_PATHS}",
                self.instance.name,
                free_path / gap
            );
            let help = "`pressure=0` leaves the film out; a `dashpot2d` has a measured damping";
            self.sink.warning("W027", self.instance.span, message, help);
        }
        let Some(sides) = sides else {
            let message = format!("no gas damps `{}`: the sides of its plates are unknown", self.instance.name);
            let help = "give `l` and `w` of the plates [m], or `pressure=0`";
            self.sink.warning("W024", self.instance.span, message, help);
            return Ok(None);
        };
        let plates = self.instance.model == "plategap2d";
        let holes = if plates { self.holes(sides)? } else { None };
        let states = if plates { self.film_states(holes.is_some())? } else { 0 };
        let count = area / (sides[0] * sides[1]);
        let height = if plates { None } else { self.positive_if_any("slit")? };
        let slit = match height {
            Some(height) => {
                let [w1, w2] = self.widths()?;
                Some(FilmSlit { height, length: w1.min(w2) })
            }
            None => None,
        };
        let gas = FacingGas { sides, count, viscosity, pressure, free_path, closed, states, holes, slit };
        Ok((viscosity > 0.0).then_some(gas))
    }

    /// Holes in one of two plates with these sides (m): `hole` and `pitch`, through the thickness `h`.
    fn holes(&mut self, sides: [f64; 2]) -> Result<Option<Perforation>, Reported> {
        let (radius, pitch) = match (self.positive_if_any("hole")?, self.positive_if_any("pitch")?) {
            (Some(radius), Some(pitch)) => (radius - 0.5 * self.etching()?, pitch),
            (None, None) => return Ok(None),
            (hole, _) => return Err(self.missing(if hole.is_none() { "hole" } else { "pitch" })),
        };
        let depth = self.positive("h")?;
        if radius <= 0.0 {
            return Err(self.out_of_range("hole", radius, "positive as etched"));
        }
        if pitch <= 2.0 * radius || pitch > sides[0].min(sides[1]) {
            let wanted = "above twice `hole` and at most the shorter side of the plates";
            return Err(self.out_of_range("pitch", pitch, wanted));
        }
        Ok(Some(Perforation { radius, pitch, depth }))
    }

    /// States of gas that compresses between lumped plates: none with holes.
    fn film_states(&mut self, holes: bool) -> Result<usize, Reported> {
        let states = self.number("filmstates")?.unwrap_or(if holes { 0.0 } else { FILM_STATES });
        if holes && states != 0.0 {
            return Err(self.out_of_range("filmstates", states, "0 beside holes, under which gas does not compress"));
        }
        if states.fract() != 0.0 || !(0.0..=MAX_FILM_STATES).contains(&states) {
            let wanted = format!("a whole number from 0 to {MAX_FILM_STATES}");
            return Err(self.out_of_range("filmstates", states, &wanted));
        }
        Ok(states as usize)
    }

    /// The field between two facing beams. Node c lies at local y = −(gap + (w1+w2)/2) under a, d under b.
    fn facing(&mut self, voltage: GapVoltage) -> Result<(), Reported> {
        let angle = self.direction(self.instance.rotation)?;
        let side = self.side()?;
        let [w1, w2] = self.widths()?;
        let (length, gap, height) = (self.positive("l")?, self.etched_gap("gap")?, self.positive("h")?);
        let permittivity = self.permittivity()?;
        let mut law = self.fringe()?;
        if law.is_none() && permittivity < REDUCED * VACUUM {
            let span = self.span_of("permittivity");
            self.drawing.note_number(Fact::ReducedPermittivity, span, permittivity);
            law = Some(Fringe::Sugar);
        }
        let electrode = self.word("electrode", &ElectrodeShape::NAMES)?;
        if electrode == Some(ElectrodeShape::Plane) {
            self.drawn_from_above()?;
        }
        let (insulation, touch) = self.insulation(gap)?;
        let touch = self.inclined_touch(touch, gap)?;
        let impact = self.impact()?;
        let gas = self.gas(Some([length, height]), length * height, gap)?;
        let offset = self.offset()?;
        let below = -(gap + (w1 + w2) / 2.0);
        let nodes: [NodeId; 4] = std::array::from_fn(|i| self.node(i));
        let offsets = [[0.0; 2], [length, 0.0], [0.0, below], [length, below]].map(|v| self.global(v));
        self.drawing.place(self.instance.span, &nodes, &offsets);
        self.drawing.structure.beam_gaps.push(BeamGap {
            name: self.name(),
            nodes,
            angle,
            side,
            length,
            gap,
            height,
            permittivity,
            widths: [w1, w2],
            law,
            electrode,
            insulation,
            touch,
            impact,
            gas,
            offset,
            voltage,
        });
        Ok(())
    }

    /// Area of a plate and its sides as etched (m², m). All edges of a plate over a plane recede; of one that faces another with its side, the ends of `l`.
    fn faces(&mut self, over_plane: bool) -> Result<(f64, [f64; 2]), Reported> {
        let (area, [l, w]) = self.drawn_faces()?;
        if self.etching()? == 0.0 {
            return Ok((area, [l, w]));
        }
        if l == 0.0 {
            return if over_plane { Ok((self.etched_body(area, 0.0)?[0], [0.0; 2])) } else { Ok((area, [0.0; 2])) };
        }
        let left = [self.etched_from("l", l)?, if over_plane { self.etched_from("w", w)? } else { w }];
        Ok((area * (left[0] / l) * (left[1] / w), left))
    }

    /// The same as drawn: `A`, `l·w`, or `A` with one or both sides. Without sides of its own the shape is unknown, and they are 0.
    fn drawn_faces(&mut self) -> Result<(f64, [f64; 2]), Reported> {
        let area = self.positive_if_any("A")?;
        let mut sides = [None; 2];
        for (side, name) in sides.iter_mut().zip(["l", "w"]) {
            if self.is_given(name) {
                *side = self.positive_if_any(name)?;
            }
        }
        match (area, sides) {
            (Some(area), [None, None]) => Ok((area, [0.0; 2])),
            (Some(area), [l, w]) => {
                let l = l.unwrap_or_else(|| area / w.unwrap_or(1.0));
                Ok((area, [l, w.unwrap_or(area / l)]))
            }
            (None, [Some(l), Some(w)]) => Ok((l * w, [l, w])),
            (None, _) => Err(self.missing("A")),
        }
    }

    fn facing_beams(&mut self) -> Result<(), Reported> {
        let [w1, w2] = self.widths()?;
        self.add_beam(format!("{}.upper", self.instance.name), [self.node(0), self.node(1)], w1)?;
        self.add_beam(format!("{}.lower", self.instance.name), [self.node(2), self.node(3)], w2)
    }

    /// The resistance of one of the two beams, from the node `end` to the next.
    fn add_resistor(&mut self, end: usize, part: &str, resistance: f64) {
        let (a, b) = (self.node(end), self.node(end + 1));
        let name = format!("{}.{part}", self.instance.name);
        self.drawing.electrical(&[a, b]);
        self.drawing.structure.resistors.push(Resistor { name, a, b, resistance });
    }

    /// Warns of a voltage given to a gap that takes it from its nodes.
    fn no_voltage(&mut self, fixed: &str) {
        if self.is_given("V") {
            let model = self.instance.model;
            let message = format!("`{model}` takes no `V`: its voltage is that between its nodes a and c");
            let help = format!("use `{fixed}` for a fixed voltage, or put a `Vsrc` or a `port` between the nodes");
            let span = self.span_of("V");
            self.sink.warning("W004", span, message, help);
        }
    }

    /// The potential difference of the nodes `i` and `j`.
    pub(super) fn across(&mut self, i: usize, j: usize) -> GapVoltage {
        let (a, b) = (self.node(i), self.node(j));
        self.drawing.electrical(&[a, b]);
        GapVoltage::Nodes(a, b)
    }
}

/// gap2d: two beams and the field between them, at a fixed voltage.
pub(super) fn gap2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let voltage = GapVoltage::Fixed(site.required("V")?);
    site.facing_beams()?;
    site.facing(voltage)
}

/// gap2dforce: the field alone, at the voltage between nodes a and c.
pub(super) fn gap2dforce(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.no_voltage("gap2d");
    let voltage = site.across(0, 2);
    site.facing(voltage)
}

/// gap2de: two conducting beams and the field between them.
pub(super) fn gap2de(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.no_voltage("gap2dV");
    let [w1, w2] = site.widths()?;
    for (end, part, width, r, g) in [(0, "upper", w1, "R1", "G1"), (2, "lower", w2, "R2", "G2")] {
        let own = site.is_given(r) || site.is_given(g);
        let (r, g) = if own { (r, g) } else { ("R", "G") };
        let resistance = site.resistance(r, g, width)?;
        site.add_resistor(end, part, resistance);
    }
    site.facing_beams()?;
    let voltage = site.across(0, 2);
    site.facing(voltage)
}

/// gap2de_b and those after it: two beams of the sheet resistance `Rs` and the field between them, which is that of `gap2de`.
pub(super) fn gap2de_b(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.no_voltage("gap2dV");
    let ([w1, w2], length, sheet) = (site.widths()?, site.positive("l")?, site.positive("Rs")?);
    site.drawing.note(Fact::TrialGap, site.instance.span);
    site.add_resistor(0, "upper", sheet * length / w1);
    site.add_resistor(2, "lower", sheet * length / w2);
    site.facing_beams()?;
    let voltage = site.across(0, 2);
    site.facing(voltage)
}

pub(super) fn gap3d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.drawing.note(Fact::OutOfPlane, site.instance.span);
    gap2d(site)
}

pub(super) fn gap3de(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    site.drawing.note(Fact::OutOfPlane, site.instance.span);
    gap2de(site)
}

/// plategap2d: two lumped plates; b lies at `gap` along local x from a.
pub(super) fn plategap2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let angle = site.direction(site.instance.rotation)?;
    let electrode = site.word("electrode", &ElectrodeShape::NAMES)?;
    let over_plane = electrode == Some(ElectrodeShape::Plane) || site.number("hole")?.is_some();
    let (area, sides) = site.faces(over_plane)?;
    let apart = site.positive("gap")?;
    let gap = if over_plane { apart } else { site.etched_gap("gap")? };
    let permittivity = site.permittivity()?;
    let law = site.fringe()?;
    let shaped = sides[0] > 0.0;
    if !shaped && site.is_given("fringe") && law != Some(Fringe::None) {
        let message = format!("the fringe field of `{}` depends on the sides of the plate", site.instance.name);
        return Err(site.sink.error("E053", site.span_of("fringe"), message, "give `l` and `w`"));
    }
    let exact = shaped && matches!(law, None | Some(Fringe::Exact));
    let thickness = if exact { site.positive("h")? } else { site.positive_if_any("h")?.unwrap_or(0.0) };
    let (insulation, touch) = site.insulation(gap)?;
    let touch = if over_plane { touch } else { site.inclined_touch(touch, gap)? };
    let impact = site.impact()?;
    let gas = site.gas(shaped.then_some(sides), area, gap)?;
    let axis = [angle.cos(), angle.sin()];
    let (a, b) = (site.node(0), site.node(1));
    let offset = site.offset()?;
    let voltage = site.across(0, 1);
    site.drawing.place(site.instance.span, &[a, b], &[[0.0; 2], [apart * axis[0], apart * axis[1]]]);
    let name = site.name();
    let plate = PlateGap {
        name,
        a,
        b,
        axis,
        area,
        gap,
        permittivity,
        sides,
        thickness,
        law,
        electrode,
        insulation,
        touch,
        impact,
        gas,
        offset,
        voltage,
    };
    site.drawing.structure.plate_gaps.push(plate);
    Ok(())
}
