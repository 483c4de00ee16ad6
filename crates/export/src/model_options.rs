//! The options of a model in one line, for reports and headers of files.

use bimorph_model::compile::CompiledModel;
use bimorph_model::discretize::{Scheme, anchor_root};
use bimorph_results::plot::axis::quantity;
use std::fmt::Write;

/// By how much four digits may be off at most (1).
const ROUNDED: f64 = 5e-4;

/// The options of a model in one line, with a line break at its end.
pub fn model_options(compiled: &CompiledModel) -> String {
    with_error(compiled, "estimated error")
}

/// The same of a run in time, whose steps have an estimated error of their own.
pub fn model_options_of_run(compiled: &CompiledModel) -> String {
    with_error(compiled, "estimated error of the mesh")
}

/// The options, with the estimated error by this name.
fn with_error(compiled: &CompiledModel, name: &str) -> String {
    let options = &compiled.options;
    let mut text = format!("tolerance {:e}", options.errors().requested());
    if options.errors().requested() < ROUNDED {
        text += " (shown to four digits; --json has all)";
    }
    if let Some(band) = options.band {
        let _ = write!(text, ", band {}", quantity(band, "Hz"));
    }
    let _ = write!(text, ", junctions {}", options.junctions.name());
    if anchor_root::is_elastic(&compiled.structure, options.anchors) {
        text.push_str(", elastic anchors");
    }
    if options.scheme != Scheme::E4 {
        let _ = write!(text, ", scheme {}", options.scheme.name());
    }
    let words = [
        (options.linear, ", linear"),
        (options.undamped, ", undamped"),
        (options.shear, ", shear"),
        (options.rotary_inertia, ", rotary inertia"),
    ];
    for (on, word) in words {
        if on {
            text.push_str(word);
        }
    }
    if let Some(error) = compiled.order.estimated_error {
        let _ = write!(text, ", {name} {error:.1e}");
    }
    text.push('\n');
    text
}
