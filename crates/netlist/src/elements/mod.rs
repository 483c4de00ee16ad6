//! The elements: parameters, checks, and their additions to the structure.

mod arguments;
mod arm;
mod beam;
mod circuit;
mod comb;
mod curve;
mod etched;
mod gap;
mod load;
mod lumped;
pub(crate) mod material;
mod meaning;
mod pinned;
mod placed;
mod pressure;
mod section;
mod silicon;
mod stop;
mod support;
mod table;
pub(crate) mod upright;

#[cfg(feature = "lua")]
pub(crate) use arguments::CURVES;
pub(crate) use arguments::{Argument, Arguments, ElementInstance, ElementSite, LONGEST};
pub(crate) use table::{ElementModel, model, models};

use super::diagnostic_sink::{DiagnosticSink, Reported};
use super::drawing::StructureBuilder;
use super::source::TextSpan;
use bimorph_base::suggest::{did_you_mean, nearest};
use bimorph_structure::ReadFunction;

/// The entry of a layer that a name which nothing reads is a slip of: near it, or the same but for its case.
pub(crate) fn meant_entry(name: &str) -> Option<&'static str> {
    if is_entry(name) || models().any(|model| model.takes(name)) {
        return None;
    }
    let alike = table::LAYER_ENTRIES.iter().find(|entry| entry.eq_ignore_ascii_case(name));
    let near = || if name.len() < 3 { None } else { nearest(name, table::LAYER_ENTRIES.iter().copied()) };
    alike.copied().or_else(near)
}

/// True for an entry that a layer may have.
pub(crate) fn is_entry(name: &str) -> bool {
    table::LAYER_ENTRIES.contains(&name)
}

/// True for a parameter of an element that is an angle (rad), besides ox, oy, oz.
pub(crate) fn turns(name: &str) -> bool {
    table::ANGLES.contains(&name)
}

/// True for a parameter whose value is a word.
pub(crate) fn is_word(name: &str) -> bool {
    table::WORDS.contains(&name)
}

/// Builds one element: checks its node count and its parameter names, then adds it to the drawing. `read` is for expressions in strings.
pub(crate) fn build(
    instance: &ElementInstance<'_>,
    drawing: &mut StructureBuilder,
    sink: &mut DiagnosticSink,
    read: ReadFunction,
) -> Result<(), Reported> {
    let Some(model) = model(instance.model) else {
        return Err(unknown(sink, instance.model, instance.span, []));
    };
    build_as((model, false), instance, drawing, sink, read)
}

/// The same with the element looked up; `sound`: it takes all of its parameters.
pub(crate) fn build_as(
    (model, sound): (&ElementModel, bool),
    instance: &ElementInstance<'_>,
    drawing: &mut StructureBuilder,
    sink: &mut DiagnosticSink,
    read: ReadFunction,
) -> Result<(), Reported> {
    let got = instance.nodes.len();
    if !model.nodes.contains(&got) {
        let wanted = match model.nodes {
            [least, .., most] if model.nodes.len() > 2 => format!("{least} to {most}"),
            counts => counts.iter().map(usize::to_string).collect::<Vec<_>>().join(" or "),
        };
        let plural = if model.nodes == [1] { "" } else { "s" };
        let message = format!("`{}` takes {wanted} node{plural}, {got} given", model.name);
        let help = format!("write `{} LAYER {}`", model.name, model.node_names);
        return Err(sink.error("E054", instance.nodes_span, message, help));
    }
    if !sound {
        stray_parameters(model, instance, sink);
    }
    let mut site = ElementSite { instance, drawing, sink, read };
    (model.build)(&mut site)?;
    site.note_surroundings()
}

/// Reports an unknown element, with the nearest known one or the reason why it is left out.
pub(crate) fn unknown<'a>(
    sink: &mut DiagnosticSink,
    name: &str,
    span: TextSpan,
    subnets: impl IntoIterator<Item = &'a str>,
) -> Reported {
    if let Some((_, reason)) = table::LEFT_OUT.iter().find(|(left_out, _)| *left_out == name) {
        return sink.error("E056", span, format!("the element `{name}` is not supported"), *reason);
    }
    // names that differ in their numbers alone are different things: `slider` is not `slider1`
    let known = models().map(|m| m.name).chain(subnets).filter(|known| !differ_in_numbers(known, name));
    let help =
        did_you_mean(name, known, "it is neither built in nor a subnet defined above; is a `uses` line missing?");
    sink.error("E055", span, format!("unknown element `{name}`"), help)
}

/// True when two names are the same but for their digits.
fn differ_in_numbers(a: &str, b: &str) -> bool {
    let letters = |name: &'_ str| name.chars().filter(|c| !c.is_ascii_digit()).collect::<String>();
    letters(a) == letters(b)
}

/// Warns of parameters that the element does not take.
fn stray_parameters(model: &ElementModel, instance: &ElementInstance<'_>, sink: &mut DiagnosticSink) {
    for argument in &instance.arguments.given {
        if model.takes(argument.name) {
            continue;
        }
        let otherwise = format!("it takes {}", model.parameters.join(" "));
        let help = did_you_mean(argument.name, model.parameters.iter().copied(), &otherwise);
        sink.warning(
            "W004",
            argument.span,
            format!("`{}` takes no parameter `{}`: ignored", model.name, argument.name),
            help,
        );
    }
}

/// Warns of a parameter that a subnet does not take when its name resembles one that it does take and that was not
/// given. All others are ignored, as SUGAR does.
pub(crate) fn stray_actuals<'a>(
    subnet: &str,
    given: &[Argument<'_>],
    formals: impl Iterator<Item = &'a str> + Clone,
    sink: &mut DiagnosticSink,
) {
    for argument in given {
        bimorph_base::budget::check();
        if formals.clone().any(|formal| formal == argument.name) || argument.name.len() < 3 {
            continue;
        }
        let free = formals.clone().filter(|formal| given.iter().all(|g| g.name != *formal));
        if let Some(meant) = nearest(argument.name, free) {
            let message = format!("subnet `{subnet}` takes no parameter `{}`: ignored", argument.name);
            sink.warning("W004", argument.span, message, format!("did you mean `{meant}`?"));
        }
    }
}
