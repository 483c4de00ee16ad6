//! Which elements there are, and what they take.

use super::super::diagnostic_sink::Reported;
use super::arguments::ElementSite;
use super::{arm, beam, circuit, comb, curve, gap, load, lumped, pinned, placed, pressure, section, stop, support};
use bimorph_structure::DomainElement;
use std::sync::LazyLock;

/// An element of the language.
#[derive(Debug)]
pub(crate) struct ElementModel {
    pub(crate) name: &'static str,
    /// Numbers of nodes it can have.
    pub(crate) nodes: &'static [usize],
    /// How messages write its node list.
    pub(crate) node_names: &'static str,
    /// Parameters it takes, besides the entries of a layer and ox, oy, oz.
    pub(crate) parameters: &'static [&'static str],
    /// True for SUGAR's own elements, whose old netlists carry parameters that were always ignored.
    pub(crate) sugar: bool,
    pub(crate) build: fn(&mut ElementSite<'_, '_>) -> Result<(), Reported>,
}

impl ElementModel {
    /// True for a parameter that means something to it, or that old netlists carry along.
    pub(crate) fn takes(&self, name: &str) -> bool {
        self.parameters.contains(&name) || LAYER_ENTRIES.contains(&name) || (self.sugar && STRAY.contains(&name))
    }
}

/// The element of that name.
pub(crate) fn model(name: &str) -> Option<&'static ElementModel> {
    models().find(|m| m.name == name)
}

/// Every element: those of the language, then those of domains that have their own.
pub(crate) fn models() -> impl Iterator<Item = &'static ElementModel> {
    static OF_DOMAINS: LazyLock<Vec<ElementModel>> = LazyLock::new(|| {
        DomainElement::ALL.iter().map(|e| own(e.name, e.nodes, e.node_names, e.parameters, placed::placed)).collect()
    });
    MODELS.iter().chain(OF_DOMAINS.iter())
}

/// Entries a layer may have; any element may override them.
pub(super) const LAYER_ENTRIES: &[&str] = &[
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
    "permittivity",
    "fringe",
    "sheetresistance",
    "resistivity",
    "stress",
    "straingradient",
    "thermalexpansion",
    "ambienttemperature",
    "substratetemperature",
    "anchortemperature",
    "thermcond",
    "specificheat",
    "gasconductivity",
    "shapefactor",
    "emissivity",
    "TCR",
    "TCK",
    "TCC",
    "yieldstress",
    "softening",
    "strength",
    "fillet",
    "anchorquality",
    "undercut",
    "packagestrain",
    "packagestrainx",
    "packagestrainy",
    "anchorx",
    "anchory",
    "overetch",
    "sidewall",
    "stressgradient",
    "h",
    "layer",
];

/// Parameters that are angles (rad), besides ox, oy, oz. (`qoz` of a prestressedbeam is in degrees everywhere.)
pub(super) const ANGLES: &[&str] = &[
    "alpha", "ox1", "oy1", "oz1", "ox2", "oy2", "oz2", "qox1", "qoy1", "qoz1", "qox2", "qoy2", "qoz2", "sliderox",
    "slideroy", "slideroz", "anchorrz",
];

/// Parameters whose values are words, which need no quotes where no variable has their name.
pub(super) const WORDS: &[&str] = &["fringe", "electrode"];

/// Parameters that SUGAR's netlists carry on elements which do not use them.
pub(super) const STRAY: &[&str] =
    &["R", "R1", "R2", "Rs", "R_insulator", "G", "G1", "G2", "V", "l", "w", "w1", "w2", "h", "x", "y", "z", "T"];

/// Number of names in some lists.
const fn count(lists: &[&[&str]]) -> usize {
    let (mut k, mut all) = (0, 0);
    while k < lists.len() {
        all += lists[k].len();
        k += 1;
    }
    all
}

/// The names of some lists, one list after the other.
const fn joined<const N: usize>(lists: &[&[&'static str]]) -> [&'static str; N] {
    let (mut all, mut next, mut k) = ([""; N], 0, 0);
    while k < lists.len() {
        let mut i = 0;
        while i < lists[k].len() {
            all[next] = lists[k][i];
            next += 1;
            i += 1;
        }
        k += 1;
    }
    all
}

/// Parameters that several elements share, in one list with those of their own.
macro_rules! joined {
    ($($list:expr),*) => {{
        const LISTS: &[&[&str]] = &[$($list),*];
        &joined::<{ count(LISTS) }>(LISTS)
    }};
}

const BEAM: &[&str] = &["l", "w", "h", "T", "curvature"];
const BEAM_E: &[&str] = joined!(BEAM, &["R", "G", "resistivity"]);
/// Rigid arms at both ends.
const ARMS: &[&str] = &["L1", "ox1", "oy1", "oz1", "L2", "ox2", "oy2", "oz2"];
const LINK: &[&str] = joined!(&["l", "w", "h", "T"], ARMS);
const ARC: &[&str] = joined!(&["radius", "alpha", "w", "h", "T"], ARMS);
const PREDISPLACED: &[&str] =
    joined!(&["l", "w", "h", "T", "qx2", "qy2", "qz2", "qox1", "qoy1", "qoz1", "qox2", "qoy2", "qoz2"], ARMS);
const PRESTRESSED: &[&str] = &["l", "w", "h", "qx", "qy", "qz", "qox", "qoy", "qoz"];
const SLIDER: &[&str] = &["l", "w", "h", "T", "sliderox", "slideroy", "slideroz"];
/// Drawing attributes that any circuit element may have.
const DRAWN: &[&str] = &[
    "V",
    "R",
    "G",
    "C",
    "L",
    "len",
    "L1",
    "ox1",
    "oy1",
    "oz1",
    "L2",
    "ox2",
    "oy2",
    "oz2",
    "linewidth",
    "nodewidth",
    "sv",
    "sph",
];
/// Nodes that one wire may join.
const WIRED: &[usize] = &[2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16];
/// Nodes that one anchor may hold.
const PADS: &[usize] = &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16];
const SIZE: &[&str] = &["l", "w", "h"];
const ANCHOR: &[&str] = joined!(SIZE, &["anchorrz", "moves"]);
/// The gas, the field and the contact of a clearance between two faces.
const CLEARANCE: &[&str] =
    &["permittivity", "fringe", "electrode", "td", "er", "voffset", "touch", "restitution", "speed", "filmgap"];
/// The two bars of a gap.
const BARS: &[&str] = &["l", "w", "w1", "w2", "gap", "h"];
const GAP: &[&str] = joined!(BARS, &["V"], CLEARANCE, &["slit"]);
const GAP_E: &[&str] = joined!(BARS, &["R", "R1", "R2", "G", "G1", "G2", "resistivity"], CLEARANCE, &["slit"]);
const GAP_SHEET: &[&str] = joined!(BARS, &["Rs"], CLEARANCE, &["slit"]);
const PLATES: &[&str] = joined!(&["A", "l", "w", "h", "gap"], CLEARANCE, &["filmstates", "hole", "pitch"]);
const STOP: &[&str] = &[
    "gap",
    "back",
    "k",
    "A",
    "hardness",
    "contactresistivity",
    "electronpath",
    "restitution",
    "speed",
    "adhesion",
    "adhesionrange",
    "friction",
    "slipspeed",
    "stickstiffness",
];
const LOAD: &[&str] = &["F", "M"];

const fn sugar(
    name: &'static str,
    nodes: &'static [usize],
    node_names: &'static str,
    parameters: &'static [&'static str],
    build: fn(&mut ElementSite<'_, '_>) -> Result<(), Reported>,
) -> ElementModel {
    ElementModel { name, nodes, node_names, parameters, sugar: true, build }
}

const fn own(
    name: &'static str,
    nodes: &'static [usize],
    node_names: &'static str,
    parameters: &'static [&'static str],
    build: fn(&mut ElementSite<'_, '_>) -> Result<(), Reported>,
) -> ElementModel {
    ElementModel { name, nodes, node_names, parameters, sugar: false, build }
}

/// Every element of the language.
const MODELS: &[ElementModel] = &[
    sugar("anchor", PADS, "[a …]", ANCHOR, support::anchor),
    sugar("bondingpad", PADS, "[a …]", ANCHOR, support::anchor),
    sugar("commonground", PADS, "[a …]", ANCHOR, support::anchor),
    sugar("hinge", &[1], "[a]", SIZE, support::hinge),
    sugar("slider", &[1], "[a]", SIZE, support::slider),
    sugar("pinjoint", &[1], "[a]", SIZE, support::pinjoint),
    sugar("pos", &[2], "[a b]", &["x", "y", "z"], support::pos),
    sugar("beam2d", &[2], "[a b]", BEAM, beam::beam2d),
    sugar("beam3d", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam2de", &[2], "[a b]", BEAM_E, beam::beam2de),
    sugar("beam2de_b", &[2], "[a b]", &["l", "w", "h", "T", "curvature", "Rs"], beam::beam2de_b),
    sugar("beam3de", &[2], "[a b]", BEAM_E, beam::beam3de),
    sugar("beam", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3d_2", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3d_a1", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3d_perf", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3da", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3db", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3dh", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3dnl", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3dnl1", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3dnl2", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3dnl3", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3dnl4", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3dnl5", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3dnl6", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam_R", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam_R2", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("nls_beam", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("prestressed", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam3dlink", &[2], "[a b]", LINK, arm::beam3dlink),
    sugar("beam3dlinkcorner", &[2], "[a b]", LINK, arm::beam3dlink),
    sugar("beam3dlink_cloak", &[2], "[a b]", LINK, arm::beam3dlink),
    sugar("beam_link_grav", &[2], "[a b]", LINK, arm::beam_link_grav),
    sugar("tracer", &[2], "[a b]", LINK, arm::tracer),
    sugar("rigidlinkbeam", &[2], "[a b]", LINK, arm::rigidlinkbeam),
    sugar("rigidlinkbeamcorner", &[2], "[a b]", LINK, arm::beam3dlink),
    sugar("rigidlinkbeamcloaked", &[2], "[a b]", LINK, arm::beam3dlink),
    sugar("semicircularbeam", &[2], "[a b]", ARC, curve::spatial_arc),
    sugar("circbeam", &[2], "[a b]", ARC, curve::spatial_arc),
    sugar("circbeam2", &[2], "[a b]", ARC, curve::spatial_arc),
    sugar("circbeam3", &[2], "[a b]", ARC, curve::spatial_arc),
    sugar("circbeam4", &[2], "[a b]", ARC, curve::spatial_arc),
    sugar("circbeam5", &[2], "[a b]", ARC, curve::spatial_arc),
    sugar("circbeam6", &[2], "[a b]", ARC, curve::spatial_arc),
    sugar("circbeam7", &[2], "[a b]", ARC, curve::spatial_arc),
    sugar("circbeam8", &[2], "[a b]", ARC, curve::spatial_arc),
    sugar("circbeam9", &[2], "[a b]", ARC, curve::spatial_arc),
    sugar("circbeam10", &[2], "[a b]", ARC, curve::spatial_arc),
    sugar("circbeam11", &[2], "[a b]", ARC, curve::spatial_arc),
    sugar("circbeam12", &[2], "[a b]", ARC, curve::spatial_arc),
    sugar("predisplacedbeam3", &[2], "[a b]", PREDISPLACED, curve::predisplaced),
    sugar("predisplacedbeam4", &[2], "[a b]", PREDISPLACED, curve::predisplaced),
    sugar("prestressedbeam", &[2], "[a b]", PRESTRESSED, load::prestressed),
    sugar("trapezoidalbeam", &[2], "[a b]", &["l", "wbottom", "wtop", "h", "T"], section::trapezoidal),
    sugar("softjointlr", &[2], "[a b]", &["l", "w", "h", "T"], section::soft_joint),
    sugar("hinge3", &[2], "[a b]", &["l", "w", "h", "T"], section::soft_joint),
    sugar("freehinge", &[2], "[a b]", SIZE, pinned::bar),
    sugar("hinge2", &[2], "[a b]", SIZE, pinned::bar),
    sugar("slider2", &[2], "[a b]", SLIDER, support::slider2),
    sugar("f2d", &[1], "[a]", LOAD, load::f2d),
    sugar("f3d", &[1], "[a]", LOAD, load::f3d),
    sugar("p3d", &[2], "[a b]", &["l", "P"], pressure::p3d),
    sugar("gap2d", &[4], "[a b c d]", GAP, gap::gap2d),
    sugar("gap2dV", &[4], "[a b c d]", GAP, gap::gap2d),
    sugar("gap3dV", &[4], "[a b c d]", GAP, gap::gap3d),
    sugar("gap2dforce", &[4], "[a b c d]", GAP, gap::gap2dforce),
    sugar("gap3dforce", &[4], "[a b c d]", GAP, gap::gap2dforce),
    sugar("gap2de", &[4], "[a b c d]", GAP_E, gap::gap2de),
    sugar("gap3de", &[4], "[a b c d]", GAP_E, gap::gap3de),
    sugar("gap2de_b", &[4], "[a b c d]", GAP_SHEET, gap::gap2de_b),
    sugar("gap2de_c", &[4], "[a b c d]", GAP_SHEET, gap::gap2de_b),
    sugar("gap2de_d", &[4], "[a b c d]", GAP_SHEET, gap::gap2de_b),
    sugar("gap2de_e", &[4], "[a b c d]", GAP_SHEET, gap::gap2de_b),
    sugar("gap2de_f", &[4], "[a b c d]", GAP_SHEET, gap::gap2de_b),
    sugar("gap2de_g", &[4], "[a b c d]", GAP_SHEET, gap::gap2de_b),
    sugar("gap2de_h", &[4], "[a b c d]", GAP_SHEET, gap::gap2de_b),
    sugar("gap2de_h_passive", &[4], "[a b c d]", GAP_SHEET, gap::gap2de_b),
    sugar("comb2d", &[2], "[a b]", &["l", "L", "w", "gap", "N", "h", "V", "permittivity"], comb::comb2d),
    sugar("R", &[2], "[a b]", &["R", "G"], circuit::resistor),
    sugar("C", &[2], "[a b]", &["C"], circuit::capacitor),
    sugar("L", &[2], "[a b]", &["L"], circuit::inductor),
    sugar("Vsrc", &[2], "[plus minus]", &["V", "sv", "sph"], circuit::voltage_source),
    sugar("resistor", &[2], "[a b]", DRAWN, circuit::drawn_resistor),
    sugar("capacitor", &[2], "[a b]", DRAWN, circuit::drawn_capacitor),
    sugar("inductor", &[2], "[a b]", DRAWN, circuit::drawn_inductor),
    sugar("voltage", &[2], "[plus minus]", DRAWN, circuit::drawn_source),
    sugar("voltagesinusoidal", &[2], "[plus minus]", DRAWN, circuit::drawn_source),
    sugar("short", &[2], "[a b]", DRAWN, circuit::drawn_short),
    sugar("eswitch", &[2], "[a b]", DRAWN, circuit::drawn_switch),
    sugar("ground", &[1, 2], "[n] or [n end]", DRAWN, circuit::drawn_ground),
    sugar("Isrc", &[2], "[plus minus]", &["I"], circuit::current_source),
    sugar("opamp", &[4], "[minus plus out reference]", &["A"], circuit::op_amp),
    sugar("vcvs", &[4], "[plus minus out reference]", &["A"], circuit::amplifier),
    sugar("eground", &[1], "[n]", &[], circuit::eground),
    own("arc2d", &[2], "[a b]", ARC, curve::arc),
    own("taper2d", &[2], "[a b]", &["l", "w1", "w2", "h", "T"], curve::taper),
    own("plate2d", &[1], "[c]", SIZE, lumped::plate2d),
    own("body2d", &[1], "[c]", &["A", "Ip", "l", "w", "h", "perimeter"], lumped::body2d),
    own("mass2d", &[1], "[n]", &["m", "J", "b", "brz"], lumped::mass2d),
    own("link2d", &[2], "[a b]", &["l"], lumped::link2d),
    own(
        "spring2d",
        &[2],
        "[a b]",
        &["kx", "ky", "krz", "kx2", "kx3", "ky2", "ky3", "krz2", "krz3", "l"],
        lumped::spring2d,
    ),
    own("damper2d", &[2], "[a b]", &["bx", "by", "brz", "l"], lumped::damper2d),
    own("guide2d", &[1], "[n]", &[], support::guide2d),
    own("plategap2d", &[2], "[a b]", PLATES, gap::plategap2d),
    own("wire", WIRED, "[a b …]", &[], circuit::wire),
    own("stop2d", &[1, 2], "[a] or [a b]", STOP, stop::stop2d),
    own(
        "comb2de",
        &[2],
        "[a b]",
        &[
            "N",
            "gap",
            "l",
            "L",
            "w",
            "h",
            "Cp",
            "misalign",
            "substrate",
            "permittivity",
            "fringe",
            "voffset",
            "touch",
            "restitution",
            "speed",
        ],
        comb::comb2de,
    ),
    own(
        "beam2det",
        &[2],
        "[a b]",
        &[
            "l",
            "w",
            "h",
            "R",
            "G",
            "resistivity",
            "thermcond",
            "thermalexpansion",
            "tau",
            "specificheat",
            "gasconductivity",
            "fluid",
            "shapefactor",
            "substratetemperature",
            "emissivity",
            "TCR",
            "TCK",
            "TCC",
            "yieldstress",
            "softening",
            "curvature",
        ],
        beam::beam2det,
    ),
    own("port", &[1, 2], "[plus] or [plus minus]", &[], circuit::port),
];

/// Why there are no triangles.
const TRIANGLE: &str =
    "in SUGAR its matrices are those of one fixed plate, whatever its sides; draw it with beams, or as `body2d`";

/// Elements of SUGAR's that have no counterpart here, and why.
pub(super) const LEFT_OUT: &[(&str, &str)] = &[
    ("gapV2", "it is in SUGAR's manual only; use `gap2d` or `gap2dforce`"),
    ("gap3dV2", "it is in SUGAR's manual only; use `gap2d` or `gap2dforce`"),
    ("anchorrot", "its file is not part of SUGAR; a support that lets its node turn is `hinge`"),
    ("beamjoint12", "its file is not part of SUGAR; a beam that bends easily is `softjointlr`"),
    ("triangle", TRIANGLE),
    ("triangle2", TRIANGLE),
    ("displace", "no displacement is prescribed here: pull with a `force` of the size that brings the node there"),
];
