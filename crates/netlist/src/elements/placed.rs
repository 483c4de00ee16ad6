//! Elements that mean something to one domain alone: where they are and their numbers are kept for it.

use super::super::diagnostic_sink::Reported;
use super::arguments::ElementSite;
use bimorph_structure::{DomainElement, PlacedElement};

/// An element of a domain's own.
pub(super) fn placed(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let Some(element) = DomainElement::ALL.iter().find(|element| element.name == site.instance.model) else {
        return Ok(());
    };
    let mut values = Vec::with_capacity(element.parameters.len());
    for parameter in element.parameters {
        values.push(site.non_negative_or(parameter, 0.0)?);
    }
    if values.iter().all(|value| *value == 0.0) {
        let message = format!("`{}` does nothing: all its coefficients are 0", site.instance.name);
        let help = format!("give {}", element.parameters.join(" or "));
        site.sink.warning("W006", site.instance.span, message, help);
    }
    let angle = site.direction(site.instance.rotation)?;
    let nodes = site.instance.nodes.clone();
    site.drawing.mechanical(&nodes);
    let name = site.name();
    site.drawing.structure.placed.push(PlacedElement { element: element.name.to_owned(), name, nodes, angle, values });
    Ok(())
}
