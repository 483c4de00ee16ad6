//! p3d: a load per length along global y on a beam, as forces and moments at its ends with the cubic weights of its shape.
//!
//! The load is a number or, as SUGAR has it, a string with x, the way from the first node: `P="-250000*x"`.

use super::super::diagnostic_sink::Reported;
use super::super::value::Value;
use super::arguments::ElementSite;
use bimorph_base::{Bundle, Setting};
use bimorph_structure::Load;

/// Pieces of the length over which the load is summed, each by Gauss's rule of three points: exact for polynomials to x² in the
/// load over the whole, and for others to a few parts in a million.
const PIECES: usize = 8;
/// Points and weights of Gauss's rule on −1…1.
const GAUSS: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

pub(super) fn p3d(site: &mut ElementSite<'_, '_>) -> Result<(), Reported> {
    let length = site.positive("l")?;
    let given = site.instance.arguments.given.iter().find(|a| a.name == "P").map(|a| (a.value.clone(), a.span));
    let (text, span) = match given {
        Some((Value::Text(text), span)) => (text.replace(".*", "*").replace("./", "/").replace(".^", "^"), span),
        _ => {
            let number = site.required("P")?;
            (format!("({number:e})"), site.span_of("P"))
        }
    };
    let law = (site.read)(&Bundle::from_text("P", &format!("param x = 0\nparam value = {text}")));
    let mut parts = [0.0; 4];
    for k in 0..3 * PIECES {
        let (point, weight) = GAUSS[k % 3];
        let s = ((k / 3) as f64 + 0.5 + 0.5 * point) / PIECES as f64;
        let loaded = law.load(&[("x".to_owned(), Setting::Number(s * length))]);
        let value = loaded.ok().and_then(|l| l.parameters.into_iter().find(|(name, _)| name == "value"));
        let Some((_, Setting::Number(load))) = value else {
            let message = "`P` is no load per length that depends on x alone".to_owned();
            return Err(site.sink.error(
                "E050",
                span,
                message,
                "write a number [N/m], or `P=\"70*x\"` with x in metres",
            ));
        };
        let part = load * 0.5 * weight * length / PIECES as f64;
        let shape = [
            1.0 - 3.0 * s * s + 2.0 * s * s * s,
            length * s * (1.0 - s) * (1.0 - s),
            3.0 * s * s - 2.0 * s * s * s,
            length * s * s * (s - 1.0),
        ];
        for (sum, weight) in parts.iter_mut().zip(shape) {
            *sum += part * weight;
        }
    }
    let nodes = [site.node(0), site.node(1)];
    site.drawing.mechanical(&nodes);
    for (node, [force, moment]) in nodes.into_iter().zip([[parts[0], parts[1]], [parts[2], parts[3]]]) {
        site.drawing.structure.loads.push(Load { name: site.name(), node, force: [0.0, force], moment });
    }
    Ok(())
}
