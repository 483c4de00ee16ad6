//! Fields of nodes and mechanical parts.

use crate::error::{DocumentError, UnwritableStructure};
use crate::json::JsonNode;
use crate::place::ValuePath;
use crate::record::{DocumentRecord, ObjectReader, ObjectSchema, field_schema, record};
use crate::value::NumberRange::{Any, NonNegative, Positive, Within};
use crate::value::{DocumentField, DocumentValue, DocumentWriter, NodeNames};
use bimorph_structure::{
    Adhesion, AnchorMotion, Beam, Friction, GasLoss, Heater, Link, Load, MAX_STICK_STIFFNESS, Mass, Material, Node,
    OhmicContact, Pad, PlacedElement, PropertyCurve, SolidHeat, SpringDamper, Stop, Support, Yield,
};

record! {
    Node: "A named point of the drawing." {
        name: "", Any, "Full name, with those of enclosing subnet instances";
        position: "m", Any, "Drawn place x, y";
        mechanical: "", Any, "True where a mechanical part touches it";
        electrical: "", Any, "True where an electrical part or a port touches it";
    }
}

record! {
    Material: "Constants of the layer that a beam is made of." {
        youngs_modulus: "Pa", Positive, "Young's modulus";
        poisson: "1", Within(-1.0, 1.0), "Poisson's ratio; of silicon along a crystal direction, the contraction across the thickness";
        shear_modulus: "Pa", Positive, "Shear modulus in the plane; left out: E/(2·(1 + ν))";
        density: "kg/m³", NonNegative, "Mass density";
        viscosity: "Pa·s", NonNegative, "Dynamic viscosity of the gas around the part; 0: no damping";
        fluid: "m", Positive, "Thickness of the gas film under the part";
        thermal_expansion: "1/K", Any, "Coefficient of thermal expansion, at ambient temperature";
        expansion_curve: "", Any, "The coefficient against temperature; left out: the same at all";
        ambient_temperature: "K", NonNegative, "Temperature at which the drawn length is free of stress";
        stress: "Pa", Any, "Residual stress, tensile positive";
        strength: "Pa", Positive, "Stress that the material bears, where it is known";
        fillet: "m", Positive, "Radius of the fillets at the ends of beams; left out: the stress has no concentration";
        anchor_quality: "1", Positive, "Q that the anchors leave a mode whose energy is in beams of this layer, where it is known";
        heat: "", Any, "Thermal constants; left out: unknown";
    }
}

record! {
    SolidHeat: "Thermal constants of a solid." {
        conductivity: "W/(m·K)", Positive, "Thermal conductivity";
        specific_heat: "J/(kg·K)", Positive, "Specific heat";
    }
}

record! {
    Beam: "A straight beam of constant rectangular section. Stiffness and mass follow from its length, not from the places of its nodes." {
        name: "", Any, "Full name";
        a: "", Any, "First node";
        b: "", Any, "Second node";
        length: "m", Positive, "Length";
        angle: "rad", Any, "Direction from a to b, from the x axis";
        width: "m", Positive, "Width in the plane";
        thickness: "m", Positive, "Thickness across the plane";
        material: "", Any, "Constants of its layer";
        temperature: "K", Any, "Prescribed mean temperature; left out: ambient, or by current";
        heater: "", Any, "Heating by current; left out: it carries none";
    }
}

record! {
    Heater: "A beam as a resistor that warms itself and conducts heat along its length." {
        resistance: "Ω", Positive, "Resistance from end to end";
        conductance: "W/K", Positive, "Thermal conductance from end to end";
        time_constant: "s", NonNegative, "Time constant of the mean rise; 0: at once; left out: from the heat capacities";
        capacity: "J/K", NonNegative, "Heat capacity; 0: unknown";
        gas: "", Any, "Loss of heat through gas";
        coefficient = 0.0: "1/K", Any, "Relative change of the resistance with the rise; left out: 0";
        thermal_coefficient = 0.0: "1/K", Any, "Relative change of the thermal resistance with the rise; left out: 0";
        capacity_coefficient = 0.0: "1/K", Any, "Relative change of the heat capacity with the rise; left out: 0";
        resistance_curve: "", Any, "Curve in whose proportion the resistance changes with temperature; left out: by the coefficient";
        conductance_curve: "", Any, "The same of the thermal conductance";
        capacity_curve: "", Any, "The same of the heat capacity";
        gas_curve: "", Any, "Curve in whose proportion the conductivity of the gas changes with temperature; left out: constant";
        emissivity = 0.0: "1", NonNegative, "Emissivity of the surface; left out: 0";
        substrate: "K", NonNegative, "Temperature of the substrate; left out: ambient";
    }
}

record! {
    PropertyCurve: "A property against temperature. One of the two lists is empty." {
        table: "K, SI", Any, "Temperatures, increasing, with the values there; between them, a monotone cubic";
        polynomial: "SI", Any, "Coefficients of the powers of the temperature, from the constant on";
    }
}

record! {
    GasLoss: "Loss of heat through gas to a substrate." {
        conductivity: "W/(m·K)", Positive, "Thermal conductivity of the gas";
        distance: "m", Positive, "Distance of the substrate";
        shape: "1", Positive, "Factor on the conduction straight below the beam";
    }
}

record! {
    Mass: "A rigid body: a plate, or a lumped mass." {
        name: "", Any, "Full name";
        node: "", Any, "Node at the centre of mass";
        mass: "kg", NonNegative, "Mass";
        inertia: "kg·m²", NonNegative, "Moment of inertia about the node";
        drag: "N·s/m, N·m·s", NonNegative, "Viscous drag on translation and rotation";
        outline: "m, m, rad", Any, "Sides along local x and y and the angle, for pictures; zeros: a lumped mass";
    }
}

record! {
    Link: "A rigid connection of two nodes without mass." {
        name: "", Any, "Full name";
        a: "", Any, "First node";
        b: "", Any, "Second node";
    }
}

record! {
    Support: "Holds some directions of a node. An anchor holds all three." {
        name: "", Any, "Full name";
        node: "", Any, "Held node";
        held: "", Any, "Held directions: local x, local y, rotation";
        angle: "rad", Any, "Angle of local x";
        undercut: "m", NonNegative, "Distance by which the pad is etched free at its edge";
        temperature: "K", NonNegative, "Temperature; left out: ambient";
        motion: "", Any, "How the anchor moves; left out: it stays as drawn";
    }
}

record! {
    AnchorMotion: "Motion of an anchor with a strained substrate, and by a given displacement and rotation." {
        strain: "1", Any, "Strain of the substrate along x and y, about the origin";
        displacement: "m", Any, "Displacement along x and y";
        rotation = 0.0: "rad", Any, "Rotation about z";
        driven = false: "", Any, "Whether analyses give it a displacement and a rotation beside these";
    }
}

record! {
    Pad: "Outline of the pad of an anchor, for drawings." {
        support: "", Any, "Index of the anchor in the list of supports, from 0";
        size: "m", Positive, "Length along local x and width across it";
    }
}

record! {
    SpringDamper: "A spring or damper in a frame that turns with the mean of its ends." {
        name: "", Any, "Full name";
        a: "", Any, "First node";
        b: "", Any, "Second node";
        angle: "rad", Any, "Angle of local x";
        stiffness: "N/m, N/m, N·m/rad", Any, "Stiffness along local x, local y, about z";
        polynomial: "N/m², N/m³; N·m/rad², N·m/rad³", Any, "Quadratic and cubic stiffness along local x, local y, about z; left out: linear";
        damping: "N·s/m, N·s/m, N·m·s/rad", NonNegative, "Damping along local x, local y, about z";
    }
}

record! {
    Load: "A dead load: it keeps its direction." {
        name: "", Any, "Full name";
        node: "", Any, "Loaded node";
        force: "N", Any, "Force x, y";
        moment: "N·m", Any, "Moment about z";
    }
}

record! {
    Yield: "How a heated beam loses its strength, so that pressure shortens it for good." {
        beam: "", Any, "Index of the beam in the list of beams, from 0";
        stress: "Pa", Positive, "Yield stress at ambient temperature";
        softening: "K", Positive, "Temperature at which no strength is left";
        strain: "1", Any, "Permanent strain so far; negative: shorter";
    }
}

record! {
    OhmicContact: "Metals that are pressed on each other." {
        hardness: "Pa", Positive, "Hardness of the softer metal";
        resistivity: "Ω·m", Positive, "Resistivity";
        electron_path: "m", NonNegative, "Mean free path of the electrons; 0: a spot much larger than it";
    }
}

record! {
    Stop: "How far a node may move along an axis before it touches." {
        name: "", Any, "Full name";
        a: "", Any, "Moving node";
        b: "", Any, "Node of the part that it touches; left out: the ground";
        axis: "1", Any, "Unit vector of the motion";
        ways: "m", Positive, "Travel along the axis and against it; null: no stop on that side";
        stiffness: "N/m", Positive, "Stiffness; left out: rigid";
        area: "m²", Positive, "Area on which a rigid stop bears";
        ohmic: "", Any, "Metals that conduct where it bears";
        impact: "", Any, "Impact losses";
        adhesion: "", Any, "Adhesion where it touches";
        friction: "", Any, "Friction of a part that slides along it";
    }
}

record! {
    Adhesion: "Attraction of surfaces that touch." {
        force: "N", Positive, "Force that tears them apart";
        range: "m", Positive, "Distance at which the attraction ends";
    }
}

record! {
    Friction: "Coulomb's friction, regularised." {
        coefficient: "1", Positive, "Coefficient of friction";
        slip_speed: "m/s", Positive, "Speed below which surfaces stick";
        stick_stiffness: "N/m", Within(0.0, MAX_STICK_STIFFNESS), "Stiffness along the surface while they stick, which gives friction to parts at rest; left out: those have none";
    }
}

record! {
    PlacedElement: "An element that means something to one domain alone." {
        element: "", Any, "Which one, as netlists call it";
        name: "", Any, "Full name";
        nodes: "", Any, "Its nodes";
        angle: "rad", Any, "Direction of local x";
        values: "SI", NonNegative, "Its parameters, in the order of docs/reference/elements.md";
    }
}
