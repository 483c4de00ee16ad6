//! Fields of gaps and of the electrical network.

use crate::error::{DocumentError, UnwritableStructure};
use crate::json::JsonNode;
use crate::place::ValuePath;
use crate::record::{DocumentRecord, ObjectReader, ObjectSchema, field_schema, record};
use crate::value::NumberRange::{Any, NonNegative, Positive, Within};
use crate::value::{DocumentField, DocumentValue, DocumentWriter, NodeNames};
use bimorph_structure::{
    BeamGap, CircuitElement, Comb, FacingGas, FilmSlit, Impact, InsulatingLayer, Perforation, PlateGap, Port, Resistor,
    VoltageSource, Wire,
};

record! {
    Impact: "How an impact of two surfaces ends." {
        restitution: "1", Within(0.0, 1.0), "Speed after an impact over that before, at the reference speed; 1: elastic";
        speed: "m/s", Positive, "Reference speed";
    }
}

record! {
    InsulatingLayer: "An insulating layer on an electrode." {
        thickness: "m", Positive, "Thickness";
        permittivity: "1", Positive, "Relative permittivity, at least 1";
    }
}

record! {
    FacingGas: "Gas between two parts that face each other." {
        sides: "m", Positive, "Sides of the rectangle that faces";
        count: "1", Positive, "Number of such rectangles";
        viscosity: "Pa·s", Positive, "Dynamic viscosity";
        pressure: "Pa", Positive, "Pressure";
        free_path: "m", NonNegative, "Mean free path of the molecules at this pressure";
        closed: "m", Positive, "Thickness of the film where the parts touch; left out: by the roughness";
        states: "1", NonNegative, "States of its compression, at most 200; 0: it does not compress";
        holes: "", Any, "Holes in one of the plates";
        slit: "", Any, "Slit over a substrate through which gas leaves one edge of the film between beams";
    }
}

record! {
    FilmSlit: "A slit at the lower edge of a film." {
        height: "m", Positive, "Distance from the substrate to the parts";
        length: "m", Positive, "Length of the way under the narrower part";
    }
}

record! {
    Perforation: "Round holes in a square array." {
        radius: "m", Positive, "Radius of a hole";
        pitch: "m", Positive, "Distance of neighbours";
        depth: "m", Positive, "Length of a hole";
    }
}

record! {
    Comb: "A comb drive: C = N·ε·h·o/g." {
        name: "", Any, "Full name";
        a: "", Any, "Node of the moving side";
        b: "", Any, "Node of the other side";
        axis: "1", Any, "Unit vector along which a moves deeper into b";
        gaps: "1", Positive, "Number of finger gaps N";
        gap: "m", Positive, "Gap between facing fingers g";
        height: "m", Positive, "Height of the fingers h";
        overlap: "m", NonNegative, "Overlap as drawn o";
        permittivity: "F/m", Positive, "Permittivity ε";
        parasitic = 0.0: "F", NonNegative, "Capacitance that does not depend on the motion; left out: 0";
        finger: "m", NonNegative, "Length and width of the fingers; a width of 0: unknown";
        law: "", Any, "Law of the fringe field; left out: exact where the width is known";
        misalignment = 0.0: "m", Any, "Distance of the fingers of a from the middle of their gaps, to the left of the axis; left out: 0";
        substrate = 0.0: "m", NonNegative, "Distance of a conducting substrate at the potential of one side; left out: none";
        sliding = 0.0: "Pa·s", NonNegative, "Drag of the gas between the fingers, per rate and overlap; left out: 0";
        touch: "m", Positive, "Distance at which the sides of the fingers touch; left out: that of nearly closed gaps";
        impact: "", Any, "Impact losses of the sides";
        finite: "", Any, "False: the force is constant whatever the overlap";
        offset = 0.0: "V", Any, "Voltage that trapped charge adds in series; left out: 0";
        voltage: "V", Any, "A fixed voltage, or the nodes between which it lies";
    }
}

record! {
    PlateGap: "Two facing lumped plates: C = ε·A/(g − u)." {
        name: "", Any, "Full name";
        a: "", Any, "Node of the moving plate";
        b: "", Any, "Node of the other plate";
        axis: "1", Any, "Unit vector from a towards b";
        area: "m²", Positive, "Area A";
        gap: "m", Positive, "Gap as drawn g";
        permittivity: "F/m", Positive, "Permittivity ε";
        sides: "m", NonNegative, "Sides of a rectangular plate; 0: unknown";
        thickness: "m", NonNegative, "Thickness of the plate";
        law: "", Any, "Law of the fringe field; left out: exact for a plate with sides";
        electrode: "", Any, "Shape of the other plate; left out: a plane";
        insulation: "", Any, "Insulating layer between the plates";
        touch: "m", Positive, "Distance at which the plates touch; left out: that of nearly closed gaps";
        impact: "", Any, "Impact losses";
        gas: "", Any, "Gas between the plates; left out: it does not damp";
        offset = 0.0: "V", Any, "Voltage that trapped charge adds in series; left out: 0";
        voltage: "V", Any, "A fixed voltage, or the nodes between which it lies";
    }
}

record! {
    BeamGap: "Two facing beams, a–b and c–d." {
        name: "", Any, "Full name";
        nodes: "", Any, "Ends of the upper beam, then of the lower one";
        angle: "rad", Any, "Direction from a to b";
        side: "1", Within(-2.0, 1.0), "1: the upper beam lies at local +y of the lower one; −1: mirrored";
        length: "m", Positive, "Length";
        gap: "m", Positive, "Gap as drawn";
        height: "m", Positive, "Height of the electrodes";
        permittivity: "F/m", Positive, "Permittivity ε";
        widths: "m", NonNegative, "Widths of the upper and the lower beam; 0: unknown";
        law: "", Any, "Law of the fringe field; left out: exact";
        electrode: "", Any, "Shape of the lower electrode; left out: by the sections";
        insulation: "", Any, "Insulating layer between the beams";
        touch: "m", Positive, "Distance at which the beams touch; left out: that of nearly closed gaps";
        impact: "", Any, "Impact losses";
        gas: "", Any, "Gas between the beams; left out: it does not damp";
        offset = 0.0: "V", Any, "Voltage that trapped charge adds in series; left out: 0";
        voltage: "V", Any, "A fixed voltage, or the nodes between which it lies";
    }
}

record! {
    Resistor: "A linear resistor." {
        name: "", Any, "Full name";
        a: "", Any, "First node";
        b: "", Any, "Second node";
        resistance: "Ω", Positive, "Resistance";
    }
}

record! {
    Wire: "Nodes on one conductor without resistance." {
        name: "", Any, "Full name";
        nodes: "", Any, "Its nodes, at least two";
    }
}

record! {
    VoltageSource: "An ideal voltage source." {
        name: "", Any, "Full name";
        plus: "", Any, "Positive node";
        minus: "", Any, "Negative node";
        voltage: "V", Any, "Potential of plus over minus";
    }
}

record! {
    CircuitElement: "An element of the circuit around the mechanism." {
        name: "", Any, "Full name";
        kind: "", Any, "Kind";
        nodes: "", Any, "Its nodes: four of an op_amp or amplifier, else two";
        value: "Ω, F, H, V, A or 1", Any, "Value in the unit of its kind";
        small_signal: "V, rad", Any, "Amplitude and phase of a voltage source in small-signal analyses";
    }
}

record! {
    Port: "An electrical port that a circuit drives." {
        name: "", Any, "Name";
        plus: "", Any, "Positive node";
        minus: "", Any, "Negative node; left out: the electrical ground";
    }
}
