//! Lumped parts: plates, masses, links, springs and dampers.

use super::super::diagnostic_sink::Reported;
use super::arguments::ElementSite;
use bimorph_structure::{Mass, SpringDamper};

/// A rigid plate centred at its node, with a Couette film under it.
pub(super) fn plate2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let (l, w, h) = (site.etched("l")?, site.etched("w")?, site.positive("h")?);
    let mass = site.density()? * l * w * h;
    let [viscosity, fluid] = site.film()?;
    let angle = site.direction(site.instance.rotation)?;
    // Second moments about the centre: of the mass per unit mass, and of the film's area per unit area.
    let radius2 = (l * l + w * w) / 12.0;
    let drag = viscosity / fluid * l * w;
    let node = site.node(0);
    site.drawing.place(site.instance.span, &[node], &[[0.0; 2]]);
    site.drawing.structure.masses.push(Mass {
        name: site.name(),
        node,
        mass,
        inertia: mass * radius2,
        drag: [drag, drag * radius2],
        outline: [l, w, angle],
    });
    Ok(())
}

/// A rigid body of any outline, given by its area and polar second moment about its node, with a Couette film under it.
pub(super) fn body2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let (area, polar, h) = (site.positive("A")?, site.positive("Ip")?, site.positive("h")?);
    let outline = [site.positive_if_any("l")?, site.positive_if_any("w")?];
    let density = site.density()?;
    let [viscosity, fluid] = site.film()?;
    let angle = site.direction(site.instance.rotation)?;
    let node = site.node(0);
    // A disk turns most easily about its centre: Ip = A²/2π.
    let least = area * area / (2.0 * std::f64::consts::PI);
    if polar < 0.99 * least {
        let wanted = format!("at least A²/(2·pi) = {least:.4e}, that of a disk of this area");
        return Err(site.out_of_range("Ip", polar, &wanted));
    }
    let [area, polar] = site.etched_body(area, polar)?;
    site.drawing.place(site.instance.span, &[node], &[[0.0; 2]]);
    site.drawing.structure.masses.push(Mass {
        name: site.name(),
        node,
        mass: density * area * h,
        inertia: density * polar * h,
        drag: [viscosity / fluid * area, viscosity / fluid * polar],
        outline: if let [Some(l), Some(w)] = outline { [l, w, angle] } else { [0.0; 3] },
    });
    Ok(())
}

pub(super) fn mass2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let mass = site.positive("m")?;
    let inertia = site.non_negative_or("J", 0.0)?;
    let drag = [site.non_negative_or("b", 0.0)?, site.non_negative_or("brz", 0.0)?];
    let node = site.node(0);
    site.drawing.place(site.instance.span, &[node], &[[0.0; 2]]);
    site.drawing.structure.masses.push(Mass { name: site.name(), node, mass, inertia, drag, outline: [0.0; 3] });
    Ok(())
}

/// A rigid, massless link; without a length it joins its nodes where others place them.
pub(super) fn link2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let angle = site.direction(site.instance.rotation)?;
    let (a, b) = (site.node(0), site.node(1));
    if site.is_given("l") {
        let l = site.non_negative_or("l", 0.0)?;
        site.add_link(site.name(), a, b, [l * angle.cos(), l * angle.sin()]);
    } else {
        site.drawing.mechanical(&[a, b]);
        site.drawing.structure.links.push(bimorph_structure::Link { name: site.name(), a, b });
    }
    Ok(())
}

pub(super) fn spring2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let stiffness = [site.number_or("kx", 0.0)?, site.number_or("ky", 0.0)?, site.number_or("krz", 0.0)?];
    let mut terms = [[0.0; 2]; 3];
    for (terms, names) in terms.iter_mut().zip([["kx2", "kx3"], ["ky2", "ky3"], ["krz2", "krz3"]]) {
        *terms = [site.number_or(names[0], 0.0)?, site.number_or(names[1], 0.0)?];
    }
    let polynomial = (terms != [[0.0; 2]; 3]).then_some(terms);
    site.spring_damper((stiffness, polynomial), [0.0; 3], "kx, ky or krz")
}

pub(super) fn damper2d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let damping =
        [site.non_negative_or("bx", 0.0)?, site.non_negative_or("by", 0.0)?, site.non_negative_or("brz", 0.0)?];
    site.spring_damper(([0.0; 3], None), damping, "bx, by or brz")
}

impl ElementSite<'_, '_> {
    /// With a stiffness and its quadratic and cubic terms.
    fn spring_damper(
        &mut self,
        (stiffness, polynomial): ([f64; 3], Option<[[f64; 2]; 3]>),
        damping: [f64; 3],
        names: &str,
    ) -> Result<(), Reported> {
        if stiffness == [0.0; 3] && damping == [0.0; 3] && polynomial.is_none() {
            let message = format!("`{}` does nothing: all its coefficients are 0", self.instance.name);
            self.sink.warning("W006", self.instance.span, message, format!("give {names}"));
        }
        let angle = self.direction(self.instance.rotation)?;
        self.warn_of_coincident_ends();
        let l = self.non_negative_or("l", 0.0)?;
        let (a, b) = (self.node(0), self.node(1));
        self.drawing.place(self.instance.span, &[a, b], &[[0.0; 2], [l * angle.cos(), l * angle.sin()]]);
        self.drawing.structure.springs.push(SpringDamper {
            name: self.name(),
            a,
            b,
            angle,
            stiffness,
            damping,
            polynomial,
        });
        Ok(())
    }
}
