//! Mechanical elements: beams with their material and heat, masses, links, supports, springs, and loads.

use super::node::NodeId;
use super::property_curve::PropertyCurve;
use serde::{Deserialize, Serialize};

/// Material constants of the layer an element is made of. Values an element overrides are already in place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Young's modulus (Pa).
    pub youngs_modulus: f64,
    /// Poisson's ratio (1); of silicon with a `crystal`, the contraction across the thickness.
    pub poisson: f64,
    /// Shear modulus in the drawing plane (Pa); none: E/(2·(1 + ν)).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_modulus: Option<f64>,
    /// Mass density (kg/m³).
    pub density: f64,
    /// Dynamic viscosity of the gas around the part (Pa·s); 0 without damping.
    pub viscosity: f64,
    /// Thickness of the gas film under the part (m).
    pub fluid: f64,
    /// Coefficient of thermal expansion, at ambient temperature where it depends on temperature (1/K).
    pub thermal_expansion: f64,
    /// The coefficient against temperature (1/K); none: it is the same at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expansion_curve: Option<PropertyCurve>,
    /// Temperature at which the drawn length is stress-free (K).
    pub ambient_temperature: f64,
    /// Residual stress of the layer (Pa), tensile positive.
    pub stress: f64,
    /// Stress that the material bears (Pa), where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strength: Option<f64>,
    /// Radius of the fillets at the ends of beams (m); none: the stress has no concentration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fillet: Option<f64>,
    /// Q that the anchors leave a mode whose energy is in beams of this layer (1), where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub anchor_quality: Option<f64>,
    /// How heat flows in it; none: unknown.
    #[serde(default)]
    pub heat: Option<SolidHeat>,
}

impl Material {
    /// Strain of a free part at a temperature (1).
    pub fn free_strain(&self, temperature: f64) -> f64 {
        match &self.expansion_curve {
            Some(curve) => curve.integral(self.ambient_temperature, temperature),
            None => self.thermal_expansion * (temperature - self.ambient_temperature),
        }
    }
}

/// Thermal constants of a solid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SolidHeat {
    /// Thermal conductivity (W/(m·K)).
    pub conductivity: f64,
    /// Specific heat (J/(kg·K)).
    pub specific_heat: f64,
}

/// Temperature at which all structural solids have melted; tungsten does at 3695 K (K).
pub const MOLTEN: f64 = 4000.0;

/// A straight beam of constant rectangular section between two nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Beam {
    /// Full element name ("b1.hot"; "anon7" where the netlist gives none).
    pub name: String,
    /// Start node.
    pub a: NodeId,
    /// End node.
    pub b: NodeId,
    /// Length from the netlist (m). Stiffness and mass come from it, not from the node positions.
    pub length: f64,
    /// Direction from `a` to `b` (rad), from the global x axis.
    pub angle: f64,
    /// In-plane width (m).
    pub width: f64,
    /// Out-of-plane thickness (m).
    pub thickness: f64,
    /// Material constants.
    pub material: Material,
    /// Prescribed mean temperature (K) (SUGAR's `T=`); none when at ambient or when heated by current.
    pub temperature: Option<f64>,
    /// Joule heating, when the beam carries current.
    pub heater: Option<Heater>,
}

/// A beam seen as a resistor that warms itself and conducts heat along its length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Heater {
    /// Electrical resistance from end to end (Ω).
    pub resistance: f64,
    /// Thermal conductance from end to end k·A/l (W/K).
    pub conductance: f64,
    /// Time constant with which the mean temperature rise follows its steady value (s), 0: at once; none where it comes of the heat
    /// capacities of all that conducts.
    pub time_constant: Option<f64>,
    /// Heat capacity ρ·c·w·h·l (J/K); 0 where no specific heat is known.
    pub capacity: f64,
    /// Loss of heat through gas, where there is one.
    pub gas: Option<GasLoss>,
    /// Relative change of the resistance with the temperature rise (1/K).
    pub coefficient: f64,
    /// Relative change of the thermal resistance with the temperature rise (1/K).
    pub thermal_coefficient: f64,
    /// Relative change of the heat capacity with the temperature rise (1/K).
    #[serde(default)]
    pub capacity_coefficient: f64,
    /// Curves in whose proportion the resistance, the thermal conductance and the heat capacity change with temperature; none: by the coefficients.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resistance_curve: Option<PropertyCurve>,
    /// See `resistance_curve`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub conductance_curve: Option<PropertyCurve>,
    /// See `resistance_curve`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub capacity_curve: Option<PropertyCurve>,
    /// Curve in whose proportion the conductivity of the gas changes with temperature; none: constant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gas_curve: Option<PropertyCurve>,
    /// Emissivity of its surface (1).
    #[serde(default)]
    pub emissivity: f64,
    /// Temperature of the substrate to which the gas conducts (K); none: ambient.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub substrate: Option<f64>,
}

/// Power that a black body radiates, per area and fourth power of its temperature (W/(m²·K⁴)).
const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;

impl Beam {
    /// Power that the heated beam radiates from all of its sides over the fourth power of its temperature (W/K⁴).
    pub fn radiation(&self) -> f64 {
        let emissivity = self.heater.as_ref().map_or(0.0, |heater| heater.emissivity);
        STEFAN_BOLTZMANN * emissivity * 2.0 * (self.width + self.thickness) * self.length
    }
}

/// Loss of heat from a beam through gas to a substrate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GasLoss {
    /// Thermal conductivity of the gas (W/(m·K)).
    pub conductivity: f64,
    /// Distance to the substrate (m).
    pub distance: f64,
    /// Factor on the conduction straight below the beam (1).
    pub shape: f64,
}

impl GasLoss {
    /// Shape factor of a beam of width `w` and thickness `h` at the distance `z` (m): conduction from its lower face, and from both
    /// of its sides as fitted for surface-micromachined beams.
    ///
    /// Reference: L. Lin, M. Chiao, "Electrothermal responses of lineshape microstructures", Sensors and Actuators A 55 (1996).
    pub fn usual_shape(w: f64, h: f64, z: f64) -> f64 {
        h / w * (2.0 * z / h + 1.0) + 1.0
    }

    /// Conductance of a beam of that width and length (m) to the substrate (W/K).
    pub fn conductance(&self, width: f64, length: f64) -> f64 {
        self.shape * self.conductivity * width / self.distance * length
    }
}

/// A rigid body's mass at a node: a plate, or a lumped mass.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mass {
    /// Full element name.
    pub name: String,
    /// Node at the centre of mass.
    pub node: NodeId,
    /// Mass (kg).
    pub mass: f64,
    /// Moment of inertia about the node (kg·m²).
    pub inertia: f64,
    /// Viscous drag on translation (N·s/m) and rotation (N·m·s) (Couette film under a plate).
    pub drag: [f64; 2],
    /// Outline for pictures: size along local x and y (m) and angle (rad); `[0, 0, 0]` for a lumped mass.
    pub outline: [f64; 3],
}

/// A rigid, massless connection of two nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// Full element name.
    pub name: String,
    /// First node.
    pub a: NodeId,
    /// Second node.
    pub b: NodeId,
}

/// Holds some directions of a node at their drawn place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Support {
    /// Full element name.
    pub name: String,
    /// Held node.
    pub node: NodeId,
    /// Held directions: local x, local y, rotation about z. An anchor holds all three.
    pub held: [bool; 3],
    /// Angle of the local x axis (rad).
    pub angle: f64,
    /// Distance by which the pad is etched free at its edge (m), where the layer says so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub undercut: Option<f64>,
    /// Its temperature (K); none: ambient.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<f64>,
    /// How the anchor moves; none: it stays as drawn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<AnchorMotion>,
}

/// Motion of an anchor: with a substrate that is strained about the origin of the drawing, and by a given displacement and rotation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct AnchorMotion {
    /// Strain of the substrate along x and y (1).
    pub strain: [f64; 2],
    /// Displacement along x and y (m).
    pub displacement: [f64; 2],
    /// Rotation about z (rad).
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rotation: f64,
    /// Whether analyses give it a displacement and a rotation beside these: its inputs.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub driven: bool,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde passes references
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// Names of the inputs of a driven anchor behind that of its node: displacements along x and y (m), rotation (rad).
pub const ANCHOR_MOTIONS: [&str; 3] = ["ux", "uy", "urz"];

/// Whether a name is that of the motion of an anchor.
pub fn is_anchor_motion(name: &str) -> bool {
    name.rsplit_once('.').is_some_and(|(_, quantity)| ANCHOR_MOTIONS.contains(&quantity))
}

impl AnchorMotion {
    /// Displacement of an anchor at a place (m).
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.strain[0] * x + self.displacement[0], self.strain[1] * y + self.displacement[1]]
    }
}

/// The outline of an anchor's pad, for drawings: from its node along local x, and as much to either side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pad {
    /// Index of the anchor in [`Structure::supports`](crate::Structure::supports).
    pub support: usize,
    /// Length along local x and width across it (m).
    pub size: [f64; 2],
}

/// A spring or viscous damper with three directions in a frame that turns with the mean of its two ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpringDamper {
    /// Full element name.
    pub name: String,
    /// First node.
    pub a: NodeId,
    /// Second node.
    pub b: NodeId,
    /// Angle of the local x axis (rad).
    pub angle: f64,
    /// Stiffness along local x (N/m), local y (N/m), about z (N·m/rad).
    pub stiffness: [f64; 3],
    /// Damping along local x (N·s/m), local y (N·s/m), about z (N·m·s/rad).
    pub damping: [f64; 3],
    /// Quadratic and cubic stiffness along local x (N/m², N/m³), local y, about z (N·m/rad², N·m/rad³), where there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub polynomial: Option<[[f64; 2]; 3]>,
}

/// A dead load at a node: it keeps its global direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Load {
    /// Full element name.
    pub name: String,
    /// Loaded node.
    pub node: NodeId,
    /// Force x, y (N).
    pub force: [f64; 2],
    /// Moment about z (N·m).
    pub moment: f64,
}

/// How a heated beam loses its strength against pressure along it, so that it is shortened for good (backbending).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Yield {
    /// Index of the beam in [`Structure::beams`](crate::Structure::beams).
    pub beam: usize,
    /// Yield stress at ambient temperature (Pa).
    pub stress: f64,
    /// Temperature at which no strength is left (K).
    pub softening: f64,
    /// Permanent strain so far (1); negative: shorter. 0 as drawn.
    pub strain: f64,
}
