//! Interactions of two parts across a gap: combs, plates, facing beams, and stops.

use super::Structure;
use super::node::NodeId;
use serde::{Deserialize, Serialize};

/// Where the voltage across a gap comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum GapVoltage {
    /// A fixed voltage from the netlist (V).
    Fixed(f64),
    /// The potential difference between two electrical nodes.
    Nodes(NodeId, NodeId),
}

/// Default distance at which surfaces touch (m); see [`touching_distance`].
pub const TOUCH: f64 = 0.1e-6;

/// Where surfaces touch that were drawn `gap` apart (m): [`TOUCH`], and in smaller gaps half of what was drawn.
#[inline]
pub fn touching_distance(gap: f64) -> f64 {
    TOUCH.min(0.5 * gap)
}

/// Least restitution of an impact (1).
pub const MIN_RESTITUTION: f64 = 0.01;

/// Reference speeds of impacts that a netlist may give (m/s).
pub const IMPACT_SPEEDS: [f64; 2] = [1e-9, 1e6];

/// How an impact of two surfaces ends, as far as a netlist says it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Impact {
    /// Speed after an impact over that before, at the reference speed (1); 1: elastic.
    #[serde(default)]
    pub restitution: Option<f64>,
    /// Reference speed (m/s).
    #[serde(default)]
    pub speed: Option<f64>,
}

/// Law of the field at the edges of electrodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Fringe {
    /// No field outside the facing area.
    None,
    /// Pressure times 1 + 0.65·g/h with the present gap g: a bar of width h over a plane (Osterberg and Senturia 1997).
    Parallel,
    /// The plane field around rectangular bars, from its conformal map.
    Exact,
    /// Pressure and charge times 1 + 1.12·gap/h with the drawn gap (SUGAR 2).
    Sugar,
}

impl Fringe {
    /// All laws with their names in netlists.
    pub const NAMES: [(&'static str, Self); 4] =
        [("none", Self::None), ("parallel", Self::Parallel), ("exact", Self::Exact), ("sugar", Self::Sugar)];

    /// Laws of gap elements that were stored without one.
    #[allow(clippy::unnecessary_wraps)]
    fn stored() -> Option<Self> {
        Some(Self::Sugar)
    }
}

/// Shape of the lower electrode, seen along the gap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ElectrodeShape {
    /// A bar as high as the upper one: both lie in one layer.
    Bar,
    /// A plane that is wider than the upper bar on both sides.
    Plane,
}

impl ElectrodeShape {
    /// Both shapes with their names in netlists.
    pub const NAMES: [(&'static str, Self); 2] = [("bar", Self::Bar), ("plane", Self::Plane)];
}

/// An insulating layer on one of two electrodes: the field has the distance of as much air as the layer counts for, its thickness over its permittivity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct InsulatingLayer {
    /// Thickness (m).
    pub thickness: f64,
    /// Relative permittivity (1).
    pub permittivity: f64,
}

impl InsulatingLayer {
    /// Distance of the field at which the surfaces touch (m).
    pub fn series(&self) -> f64 {
        self.thickness / self.permittivity
    }

    /// Distance between the electrodes less that of the field (m).
    pub fn shortening(&self) -> f64 {
        self.thickness - self.series()
    }
}

/// Height over the upper width above which an anchored lower electrode is a plane, where the netlist names no shape (1). Bars of that ratio itself are bars.
const FLAT: f64 = 5.0 * (1.0 + 1e-6);

/// A comb drive: C = N·ε·h·o/g with overlap o = o₀ + u, u the approach of `a` towards `b` along `axis`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comb {
    /// Full element name.
    pub name: String,
    /// Moving side (rotor) node.
    pub a: NodeId,
    /// Other side (stator) node.
    pub b: NodeId,
    /// Unit vector along which `a` moves deeper into `b`.
    pub axis: [f64; 2],
    /// Number of finger gaps N (1) (SUGAR's N: C' = N·ε·h/g).
    pub gaps: f64,
    /// Gap between facing fingers g (m).
    pub gap: f64,
    /// Height of the fingers h (m).
    pub height: f64,
    /// Overlap as drawn o₀ (m).
    pub overlap: f64,
    /// Permittivity ε (F/m).
    pub permittivity: f64,
    /// Capacitance that does not depend on the motion (F).
    pub parasitic: f64,
    /// Length and width of its fingers (m), for drawings; a width of 0 where the netlist gives none.
    #[serde(default)]
    pub finger: [f64; 2],
    /// Law of the fringe field; none: `exact` where the width of the fingers is known, and no field in a model as SUGAR computes.
    #[serde(default = "Fringe::stored")]
    pub law: Option<Fringe>,
    /// Distance of the fingers of `a` from the middle of their gaps as drawn, to the left of the axis (m).
    #[serde(default)]
    pub misalignment: f64,
    /// Distance of a conducting substrate under the fingers, at the potential of one side (m); 0: there is none.
    #[serde(default)]
    pub substrate: f64,
    /// Drag of the gas that slides between the fingers, per rate and overlap (Pa·s); 0: it does not drag.
    #[serde(default)]
    pub sliding: f64,
    /// Distance at which the sides of the fingers touch (m); none: that of nearly closed gaps of their size.
    #[serde(default)]
    pub touch: Option<f64>,
    /// Impact losses of the sides.
    #[serde(default)]
    pub impact: Impact,
    /// False for SUGAR's `comb2d`, whose force is constant whatever the overlap.
    pub finite: bool,
    /// Voltage that trapped charge adds to that of its nodes, from the second side to the first (V).
    #[serde(default)]
    pub offset: f64,
    /// Where its voltage comes from.
    pub voltage: GapVoltage,
}

/// Two facing lumped plates: C = ε·A/(g₀ − u), u the approach of `a` towards `b` along `axis`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlateGap {
    /// Full element name.
    pub name: String,
    /// Moving plate's node.
    pub a: NodeId,
    /// Other plate's node.
    pub b: NodeId,
    /// Unit vector from plate `a` towards plate `b`.
    pub axis: [f64; 2],
    /// Area A (m²).
    pub area: f64,
    /// Gap as drawn g₀ (m).
    pub gap: f64,
    /// Permittivity ε (F/m).
    pub permittivity: f64,
    /// Sides of a rectangular plate (m); 0: unknown, and no fringe field.
    #[serde(default)]
    pub sides: [f64; 2],
    /// Thickness of the plate (m); 0: unknown, and no field in `exact`.
    #[serde(default)]
    pub thickness: f64,
    /// Law of the fringe field of a plate with sides; none: `exact`, and no field in a model as SUGAR computes.
    #[serde(default)]
    pub law: Option<Fringe>,
    /// Shape of the other plate, where the netlist names it; a plane by default.
    #[serde(default)]
    pub electrode: Option<ElectrodeShape>,
    /// Insulating layer between the plates.
    #[serde(default)]
    pub insulation: Option<InsulatingLayer>,
    /// Distance at which the plates touch (m); none: that of nearly closed gaps of their size.
    #[serde(default)]
    pub touch: Option<f64>,
    /// Impact losses.
    #[serde(default)]
    pub impact: Impact,
    /// Gas between the plates; none: it does not damp.
    #[serde(default)]
    pub gas: Option<FacingGas>,
    /// Voltage that trapped charge adds to that of its nodes, from the second side to the first (V).
    #[serde(default)]
    pub offset: f64,
    /// Where its voltage comes from.
    pub voltage: GapVoltage,
}

/// Gas between two parts that face each other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FacingGas {
    /// Sides of the rectangle that faces (m): those of a plate, length and height of a beam.
    pub sides: [f64; 2],
    /// Number of such rectangles (1).
    pub count: f64,
    /// Dynamic viscosity μ (Pa·s).
    pub viscosity: f64,
    /// Pressure p₀ (Pa).
    pub pressure: f64,
    /// Mean free path λ of its molecules at this pressure (m).
    pub free_path: f64,
    /// Thickness of the film where the parts touch (m); none: that of the default roughness on insulation, or the distance at which
    /// they touch where the netlist gives none.
    pub closed: Option<f64>,
    /// States of its compression between lumped plates; 0: it does not compress.
    #[serde(default)]
    pub states: usize,
    /// Holes in one of the plates.
    #[serde(default)]
    pub holes: Option<Perforation>,
    /// Slit over a substrate through which gas leaves one edge of the film between beams.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slit: Option<FilmSlit>,
}

/// A slit at the lower edge of a film.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FilmSlit {
    /// Distance from the substrate to the parts (m).
    pub height: f64,
    /// Length of the way under the narrower part (m).
    pub length: f64,
}

/// Round holes in a square array.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Perforation {
    /// Radius of a hole (m).
    pub radius: f64,
    /// Distance of neighbours (m).
    pub pitch: f64,
    /// Length of a hole: thickness of the plate (m).
    pub depth: f64,
}

/// Most states of gas in a gap.
pub const MAX_FILM_STATES: f64 = 200.0;

/// Two facing beams `a`–`b` and `c`–`d` (SUGAR's gap2d family): pressure ½εV²/g(s)² and contact along their length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BeamGap {
    /// Full element name.
    pub name: String,
    /// Upper beam's ends, then the lower beam's: a, b, c, d.
    pub nodes: [NodeId; 4],
    /// Direction from `a` to `b` (rad).
    pub angle: f64,
    /// +1: the upper beam lies at local +y of the lower one; −1 where the element was mirrored.
    pub side: f64,
    /// Length (m).
    pub length: f64,
    /// Gap as drawn (m).
    pub gap: f64,
    /// Height of the electrodes (m).
    pub height: f64,
    /// Permittivity ε (F/m).
    pub permittivity: f64,
    /// Widths of the upper and the lower beam (m); 0: unknown.
    #[serde(default)]
    pub widths: [f64; 2],
    /// Law of the fringe field; none: `exact`, and SUGAR's in a model as SUGAR computes.
    #[serde(default = "Fringe::stored")]
    pub law: Option<Fringe>,
    /// Shape of the lower electrode, where the netlist names it.
    #[serde(default)]
    pub electrode: Option<ElectrodeShape>,
    /// Insulating layer between the beams.
    #[serde(default)]
    pub insulation: Option<InsulatingLayer>,
    /// Distance at which the beams touch (m); none: that of nearly closed gaps of their size.
    #[serde(default)]
    pub touch: Option<f64>,
    /// Impact losses.
    #[serde(default)]
    pub impact: Impact,
    /// Gas between the beams; none: it does not damp.
    #[serde(default)]
    pub gas: Option<FacingGas>,
    /// Voltage that trapped charge adds to that of its nodes, from the second side to the first (V).
    #[serde(default)]
    pub offset: f64,
    /// Where its voltage comes from.
    pub voltage: GapVoltage,
}

impl BeamGap {
    /// SUGAR's factor on capacitance and force for the fringe field (1).
    pub fn sugar_factor(&self) -> f64 {
        1.0 + 1.12 * self.gap / self.height
    }

    /// The law of its fringe field: the named one, else `exact`, or SUGAR's where the model is as SUGAR computes (`sugar`).
    pub fn fringe(&self, sugar: bool) -> Fringe {
        self.law.unwrap_or(if sugar { Fringe::Sugar } else { Fringe::Exact })
    }

    /// Width of two equal beams in place of these (m): the geometric mean. Capacitance does not depend on which beam is which and
    /// grows with the logarithm of the width, so that this is exact to first order in ln(w₁/w₂).
    pub fn mean_width(&self) -> f64 {
        (self.widths[0] * self.widths[1]).sqrt()
    }

    /// Shape of the lower electrode: the given one, else a plane where both its nodes are anchored (`fixed`) and the upper beam is more than
    /// five times as high as wide. A beam over a substrate is drawn from the side in this way.
    pub fn shape(&self, fixed: bool) -> ElectrodeShape {
        let flat = fixed && self.widths[0] > 0.0 && self.height > FLAT * self.widths[0];
        self.electrode.unwrap_or(if flat { ElectrodeShape::Plane } else { ElectrodeShape::Bar })
    }
}

impl Structure {
    /// Gaps, plates and combs with an offset voltage (V), by name.
    pub fn gap_offsets(&self) -> impl Iterator<Item = (&str, f64)> {
        let gaps = self.beam_gaps.iter().map(|gap| (gap.name.as_str(), gap.offset));
        let plates = self.plate_gaps.iter().map(|plate| (plate.name.as_str(), plate.offset));
        let combs = self.combs.iter().map(|comb| (comb.name.as_str(), comb.offset));
        gaps.chain(plates).chain(combs).filter(|(_, offset)| *offset != 0.0)
    }

    /// The voltages of all gaps, plates and combs, by name.
    pub fn gap_voltages(&self) -> impl Iterator<Item = (&str, &GapVoltage)> {
        let gaps = self.beam_gaps.iter().map(|gap| (gap.name.as_str(), &gap.voltage));
        let plates = self.plate_gaps.iter().map(|plate| (plate.name.as_str(), &plate.voltage));
        let combs = self.combs.iter().map(|comb| (comb.name.as_str(), &comb.voltage));
        gaps.chain(plates).chain(combs)
    }

    /// Gives all gaps, plates and combs the same law of their fringe fields.
    pub fn prescribe_fringe(&mut self, law: Fringe) {
        let gaps = self.beam_gaps.iter_mut().map(|gap| &mut gap.law);
        let plates = self.plate_gaps.iter_mut().map(|plate| &mut plate.law);
        gaps.chain(plates).chain(self.combs.iter_mut().map(|comb| &mut comb.law)).for_each(|own| *own = Some(law));
    }
}

/// Metals that are pressed on each other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OhmicContact {
    /// Hardness of the softer metal (Pa).
    pub hardness: f64,
    /// Resistivity (Ω·m).
    pub resistivity: f64,
    /// Mean free path of the electrons (m); 0: a spot much larger than it.
    pub electron_path: f64,
}

/// A stop: how far one node may move along an axis towards another before they touch, and against it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stop {
    /// Full element name.
    pub name: String,
    /// Moving node.
    pub a: NodeId,
    /// The part that it touches; `None`: the ground.
    pub b: Option<NodeId>,
    /// Unit vector of the motion.
    pub axis: [f64; 2],
    /// Way along the axis and against it until they touch (m); none: no stop on that side.
    pub ways: [Option<f64>; 2],
    /// Stiffness of the stop (N/m); none: rigid.
    pub stiffness: Option<f64>,
    /// Area on which a rigid stop bears (m²).
    pub area: f64,
    /// Metals that conduct where it bears, if there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ohmic: Option<OhmicContact>,
    /// Impact losses.
    #[serde(default)]
    pub impact: Impact,
    /// Adhesion where it touches.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adhesion: Option<Adhesion>,
    /// Friction of a part that slides along it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<Friction>,
}

/// Attraction of surfaces that touch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Adhesion {
    /// Force that tears them apart (N).
    pub force: f64,
    /// Distance at which the attraction ends (m).
    pub range: f64,
}

/// Largest stiffness along a surface to which a part sticks (N/m): a thousand times that of the stiffest contacts. Rounding of displacements would decide on
/// forces of stiffer ones.
pub const MAX_STICK_STIFFNESS: f64 = 1e9;

/// Coulomb's friction, regularised.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Friction {
    /// Coefficient of friction (1).
    pub coefficient: f64,
    /// Speed below which surfaces stick (m/s).
    pub slip_speed: f64,
    /// Stiffness along the surface while they stick, which gives friction to parts at rest (N/m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stick_stiffness: Option<f64>,
}
