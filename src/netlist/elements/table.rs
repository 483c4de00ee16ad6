//! Which elements there are, and what they take.

use super::super::sink::Reported;
use super::arguments::Site;
use super::{beam, circuit, comb, gap, load, lumped, stop, support};

/// An element of the language.
pub(crate) struct Model {
    pub(crate) name: &'static str,
    /// Numbers of nodes it can have.
    pub(crate) nodes: &'static [usize],
    /// How messages write its node list.
    pub(crate) node_names: &'static str,
    /// Parameters it takes, besides the entries of a layer and ox, oy, oz.
    pub(crate) parameters: &'static [&'static str],
    /// True for SUGAR's own elements, whose old netlists carry parameters that were always ignored.
    pub(crate) sugar: bool,
    pub(crate) build: fn(&mut Site<'_, '_>) -> Result<(), Reported>,
}

/// The element of that name.
pub(crate) fn model(name: &str) -> Option<&'static Model> {
    MODELS.iter().find(|m| m.name == name)
}

/// Entries a layer may have; any element may override them.
pub(super) const LAYER_ENTRIES: &[&str] = &[
    "Youngsmodulus",
    "Poisson",
    "density",
    "viscosity",
    "fluid",
    "permittivity",
    "sheetresistance",
    "resistivity",
    "stress",
    "straingradient",
    "thermalexpansion",
    "ambienttemperature",
    "thermcond",
    "specificheat",
    "yieldstress",
    "softening",
    "h",
    "layer",
];

/// Parameters that SUGAR's netlists carry on elements which do not use them.
pub(super) const STRAY: &[&str] =
    &["R", "R1", "R2", "Rs", "R_insulator", "G", "G1", "G2", "V", "l", "w", "w1", "w2", "h", "x", "y", "z", "T"];

const BEAM: &[&str] = &["l", "w", "h", "T", "curvature"];
const BEAM_E: &[&str] = &["l", "w", "h", "T", "curvature", "R", "G", "resistivity"];
const LINK: &[&str] = &["l", "w", "h", "T", "L1", "ox1", "oy1", "oz1", "L2", "ox2", "oy2", "oz2"];
const SIZE: &[&str] = &["l", "w", "h"];
const GAP: &[&str] = &["l", "w", "w1", "w2", "gap", "h", "V", "permittivity", "touch"];
const GAP_E: &[&str] =
    &["l", "w", "w1", "w2", "gap", "h", "R", "R1", "R2", "G", "G1", "G2", "resistivity", "permittivity", "touch"];
const LOAD: &[&str] = &["F", "M"];

const fn sugar(
    name: &'static str,
    nodes: &'static [usize],
    node_names: &'static str,
    parameters: &'static [&'static str],
    build: fn(&mut Site<'_, '_>) -> Result<(), Reported>,
) -> Model {
    Model { name, nodes, node_names, parameters, sugar: true, build }
}

const fn own(
    name: &'static str,
    nodes: &'static [usize],
    node_names: &'static str,
    parameters: &'static [&'static str],
    build: fn(&mut Site<'_, '_>) -> Result<(), Reported>,
) -> Model {
    Model { name, nodes, node_names, parameters, sugar: false, build }
}

/// Every element.
pub(crate) const MODELS: &[Model] = &[
    sugar("anchor", &[1], "[a]", SIZE, support::anchor),
    sugar("bondingpad", &[1], "[a]", SIZE, support::anchor),
    sugar("commonground", &[1], "[a]", SIZE, support::anchor),
    sugar("hinge", &[1], "[a]", SIZE, support::hinge),
    sugar("slider", &[1], "[a]", SIZE, support::slider),
    sugar("pinjoint", &[1], "[a]", SIZE, support::pinjoint),
    sugar("pos", &[2], "[a b]", &["x", "y", "z"], support::pos),
    sugar("beam2d", &[2], "[a b]", BEAM, beam::beam2d),
    sugar("beam3d", &[2], "[a b]", BEAM, beam::beam3d),
    sugar("beam2de", &[2], "[a b]", BEAM_E, beam::beam2de),
    sugar("beam3de", &[2], "[a b]", BEAM_E, beam::beam3de),
    sugar("beam3dlink", &[2], "[a b]", LINK, beam::beam3dlink),
    sugar("beam3dlinkcorner", &[2], "[a b]", LINK, beam::beam3dlink),
    sugar("beam3dlink_cloak", &[2], "[a b]", LINK, beam::beam3dlink),
    sugar("f2d", &[1], "[a]", LOAD, load::f2d),
    sugar("f3d", &[1], "[a]", LOAD, load::f3d),
    sugar("gap2d", &[4], "[a b c d]", GAP, gap::gap2d),
    sugar("gap2dV", &[4], "[a b c d]", GAP, gap::gap2d),
    sugar("gap3dV", &[4], "[a b c d]", GAP, gap::gap3d),
    sugar("gap2dforce", &[4], "[a b c d]", GAP, gap::gap2dforce),
    sugar("gap3dforce", &[4], "[a b c d]", GAP, gap::gap2dforce),
    sugar("gap2de", &[4], "[a b c d]", GAP_E, gap::gap2de),
    sugar("gap3de", &[4], "[a b c d]", GAP_E, gap::gap3de),
    sugar("comb2d", &[2], "[a b]", &["l", "L", "w", "gap", "N", "h", "V", "permittivity"], comb::comb2d),
    sugar("R", &[2], "[a b]", &["R", "G"], circuit::resistor),
    sugar("C", &[2], "[a b]", &["C"], circuit::capacitor),
    sugar("L", &[2], "[a b]", &["L"], circuit::inductor),
    sugar("Vsrc", &[2], "[plus minus]", &["V"], circuit::voltage_source),
    sugar("Isrc", &[2], "[plus minus]", &["I"], circuit::current_source),
    sugar("opamp", &[4], "[minus plus out reference]", &["A"], circuit::op_amp),
    sugar("vcvs", &[4], "[plus minus out reference]", &["A"], circuit::amplifier),
    sugar("eground", &[1], "[n]", &[], circuit::eground),
    own("plate2d", &[1], "[c]", SIZE, lumped::plate2d),
    own("mass2d", &[1], "[n]", &["m", "J"], lumped::mass2d),
    own("link2d", &[2], "[a b]", &["l"], lumped::link2d),
    own("spring2d", &[2], "[a b]", &["kx", "ky", "krz", "l"], lumped::spring2d),
    own("damper2d", &[2], "[a b]", &["bx", "by", "brz", "l"], lumped::damper2d),
    own("guide2d", &[1], "[n]", &[], support::guide2d),
    own("plategap2d", &[2], "[a b]", &["A", "gap", "permittivity", "touch"], gap::plategap2d),
    own("stop2d", &[1, 2], "[a] or [a b]", &["gap", "back", "k", "A"], stop::stop2d),
    own("comb2de", &[2], "[a b]", &["N", "gap", "l", "L", "w", "h", "Cp", "permittivity"], comb::comb2de),
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
            "yieldstress",
            "softening",
            "curvature",
        ],
        beam::beam2det,
    ),
    own("port", &[1, 2], "[plus] or [plus minus]", &[], circuit::port),
];

/// Elements of SUGAR's that have no counterpart here, and why.
pub(super) const LEFT_OUT: &[(&str, &str)] = &[
    ("predisplacedbeam4", "draw the curved beam as a chain of short `beam2d`"),
    ("semicircularbeam", "draw the curved beam as a chain of short `beam2d`"),
    ("circbeam", "draw the curved beam as a chain of short `beam2d`"),
    ("circbeam3", "draw the curved beam as a chain of short `beam2d`"),
    ("gapV2", "it is in SUGAR's manual only; use `gap2d` or `gap2dforce`"),
    ("gap3dV2", "it is in SUGAR's manual only; use `gap2d` or `gap2dforce`"),
];

/// What a parameter is, with its unit, for messages.
pub(super) fn meaning(name: &str) -> &'static str {
    match name {
        "l" => "length [m]",
        "w" => "width [m]",
        "w1" => "width of the upper beam [m]",
        "w2" => "width of the lower beam [m]",
        "h" => "thickness of the layer [m]",
        "L" => "inductance [H], or finger length [m]",
        "L1" | "L2" => "length of a rigid arm [m]",
        "gap" => "gap [m]",
        "back" => "way against local x [m]",
        "k" => "stiffness [N/m]",
        "touch" => "distance at which the parts touch [m]",
        "N" => "number of gaps [1]",
        "A" => "gain [1], or area [m²]",
        "I" => "current [A]",
        "V" => "voltage [V]",
        "R" | "R1" | "R2" => "resistance [Ω]",
        "G" | "G1" | "G2" => "conductance [S]",
        "Cp" | "C" => "capacitance [F]",
        "F" => "force [N]",
        "M" => "moment [N·m]",
        "T" => "mean temperature [K]",
        "m" => "mass [kg]",
        "J" => "moment of inertia [kg·m²]",
        "kx" | "ky" => "stiffness [N/m]",
        "krz" => "rotational stiffness [N·m/rad]",
        "bx" | "by" => "damping [N·s/m]",
        "brz" => "rotational damping [N·m·s]",
        "x" | "y" | "z" => "coordinate [m]",
        "tau" => "thermal time constant [s]",
        "Youngsmodulus" => "Young's modulus [Pa]",
        "Poisson" => "Poisson's ratio [1]",
        "density" => "density [kg/m³]",
        "viscosity" => "viscosity of the gas [Pa·s]",
        "fluid" => "thickness of the gas film [m]",
        "permittivity" => "permittivity [F/m]",
        "sheetresistance" => "sheet resistance [Ω/square]",
        "resistivity" => "resistivity [Ω·m]",
        "stress" => "residual stress [Pa]",
        "straingradient" => "strain gradient [1/m]",
        "thermalexpansion" => "thermal expansion [1/K]",
        "ambienttemperature" => "ambient temperature [K]",
        "thermcond" => "thermal conductivity [W/(m·K)]",
        "specificheat" => "specific heat [J/(kg·K)]",
        "yieldstress" => "yield stress at ambient temperature [Pa]",
        "softening" => "temperature without strength [K]",
        "curvature" => "rest curvature [1/m]",
        _ => "angle [rad]",
    }
}
