//! The page with its scripts, and the self-contained page of an export.
//!
//! Scripts are modules in the source, so that each names its imports. Served, they are one module: imports and the words `export` are left out, which
//! is right since no two of them define the same name.

use serde_json::{Map, Value, json};

/// Style of the page.
pub(crate) const STYLE: &str = include_str!("../page/bench.css");
/// Frame of the page.
const FRAME: &str = include_str!("../page/bench.html");

/// Scripts in the order of their imports.
const SCRIPTS: [&str; 16] = [
    include_str!("../page/units.js"),
    include_str!("../page/dom.js"),
    include_str!("../page/transport.js"),
    include_str!("../page/axes.js"),
    include_str!("../page/chart.js"),
    include_str!("../page/figure.js"),
    include_str!("../page/waveform.js"),
    include_str!("../page/controls.js"),
    include_str!("../page/editor.js"),
    include_str!("../page/tab_static.js"),
    include_str!("../page/tab_modes.js"),
    include_str!("../page/tab_path.js"),
    include_str!("../page/tab_transient.js"),
    include_str!("../page/tab_response.js"),
    include_str!("../page/tab_more.js"),
    include_str!("../page/bench.js"),
];

/// Bytes of the page with its style and scripts.
pub const SCRIPT_BYTES: usize = {
    let mut bytes = STYLE.len() + FRAME.len();
    let mut k = 0;
    while k < SCRIPTS.len() {
        bytes += SCRIPTS[k].len();
        k += 1;
    }
    bytes
};

/// The scripts as one module, which exports `mount` and, for a notebook, `render`.
pub(crate) fn script() -> String {
    let mut all = bundled();
    all.push_str("\nexport { mount, Transport, WidgetTransport };\nexport default { render };\nautomount();\n");
    all
}

fn bundled() -> String {
    let mut all = String::with_capacity(SCRIPT_BYTES);
    for line in SCRIPTS.iter().flat_map(|script| script.lines()) {
        if !line.starts_with("import ") {
            all.push_str(line.strip_prefix("export ").unwrap_or(line));
            all.push('\n');
        }
    }
    all
}

/// The page of a device.
pub(crate) fn html(title: &str) -> String {
    let head = "<link rel=\"stylesheet\" href=\"bench.css\"><script type=\"module\" src=\"bench.js\"></script>";
    FRAME.replace("<!--TITLE-->", &escaped(title)).replace("<!--HEAD-->", head).replace("<!--BODY-->", "")
}

/// A page that needs nothing else: `records` are in it, and the state `view` of its controls.
pub(crate) fn self_contained(title: &str, records: &Map<String, Value>, view: &Value) -> String {
    // no text of a netlist can end the script
    let data = json!({ "records": records, "view": view }).to_string().replace('<', "\\u003c");
    let policy = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:";
    let head = format!("<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\"><style>{STYLE}</style>");
    let body =
        format!("<script>\n(() => {{\n{}const RECORDED = {data};\nautomount(RECORDED);\n}})();\n</script>", bundled());
    FRAME.replace("<!--TITLE-->", &escaped(title)).replace("<!--HEAD-->", &head).replace("<!--BODY-->", &body)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Base 64 with padding (RFC 4648).
pub(crate) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let bits = three.iter().enumerate().fold(0, |bits, (k, byte)| bits | u32::from(*byte) << (16 - 8 * k));
        for k in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * k)) as usize & 63];
            text.push(if k <= three.len() { char::from(digit) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// Base 64 of RFC 4648, section 10.
    #[test]
    fn base_64() {
        let coded = ["", "f", "fo", "foo", "foob", "fooba", "foobar"].map(|text| base64(text.as_bytes()));
        assert_eq!(coded, ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"]);
    }

    /// Page, style and scripts have at most 300 kB, name nothing outside, and no two scripts define one name.
    #[test]
    fn the_page_is_small_and_whole() {
        const { assert!(SCRIPT_BYTES <= 300_000) };
        let text = bundled() + STYLE + FRAME;
        let outside = text.replace("http://www.w3.org/", "");
        assert!(!outside.contains("http://") && !outside.contains("https://") && !outside.contains("@import"));
        assert!(!text.contains("</script"), "the scripts fit into a page");
        let mut names = BTreeSet::new();
        for line in bundled().lines() {
            let mut words = line.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '$'));
            let first = words.next().unwrap_or("");
            if ["const", "let", "function", "class", "async"].contains(&first) {
                let name = words.find(|word| !word.is_empty() && *word != "function").unwrap_or("");
                assert!(names.insert(name.to_owned()), "`{name}` is defined twice");
            }
        }
        assert!(names.contains("mount") && names.contains("automount"), "{names:?}");
    }
}
