//! Bars with a pin at each end: freehinge and hinge2 of Clark's models for SUGAR, which have the stiffness E·A/l along them and
//! none across.
//!
//! Such a bar is a rigid body of its mass m = ρ·w·h·l and inertia m·l²/12 about its middle, and at each end a pin of 2·E·A/l in
//! every direction. Along the bar the two pins are E·A/l; across it they carry nothing but inertia, also where it turns far.

use super::super::diagnostic_sink::Reported;
use super::arguments::ElementSite;
use bimorph_structure::{Mass, SpringDamper};

/// A bar between two pins.
pub(super) fn bar(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let (length, width, height) = (site.positive("l")?, site.etched("w")?, site.positive("h")?);
    let angle = site.direction(site.instance.rotation)?;
    let material = site.material()?;
    let [a, b] = [site.node(0), site.node(1)];
    let (name, span) = (site.name(), site.instance.span);
    let half = site.global([0.5 * length, 0.0]);
    let middle = site.drawing.add_node(format!("{name}.middle"), span);
    let mass = material.density * width * height * length;
    let radius2 = length * length / 12.0;
    let drag = material.viscosity / material.fluid * width * length;
    site.drawing.place(span, &[a, middle, b], &[[0.0; 2], half, [2.0 * half[0], 2.0 * half[1]]]);
    site.drawing.structure.masses.push(Mass {
        name: name.clone(),
        node: middle,
        mass,
        inertia: mass * radius2,
        drag: [drag, drag * radius2],
        outline: [length, width, angle],
    });
    let stiffness = 2.0 * material.youngs_modulus * width * height / length;
    for (end, node, sign) in [("start", a, -1.0), ("end", b, 1.0)] {
        let tip = site.drawing.add_node(format!("{name}.{end}"), span);
        site.add_link(format!("{name}.half_{end}"), middle, tip, [sign * half[0], sign * half[1]]);
        site.drawing.place(span, &[node, tip], &[[0.0; 2]; 2]);
        site.drawing.structure.springs.push(SpringDamper {
            name: format!("{name}.pin_{end}"),
            a: node,
            b: tip,
            angle,
            stiffness: [stiffness, stiffness, 0.0],
            damping: [0.0; 3],
            polynomial: None,
        });
    }
    Ok(())
}
