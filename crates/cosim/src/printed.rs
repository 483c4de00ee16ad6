//! Output section of a generated deck: the scales of its signals, and its `.print` lines, without which `ngspice -b`
//! runs nothing.

use std::fmt::Write;

/// A line for each kind of analysis among `analyses` (`.tran 1u 1m`): voltages of these nodes and currents of these sources, of small signals
/// their magnitudes and phases.
pub(super) fn prints(analyses: &[String], nodes: &[&str], sources: &[&str]) -> String {
    let mut text = String::new();
    let mut kinds: Vec<&str> = Vec::new();
    for kind in analyses.iter().filter_map(|line| line.split_whitespace().next()?.strip_prefix('.')) {
        if kinds.contains(&kind) {
            continue;
        }
        kinds.push(kind);
        let parts: &[&str] = if kind == "ac" { &["m", "p"] } else { &[""] };
        let of = |letter: char, names: &[&str]| {
            names
                .iter()
                .flat_map(|name| parts.iter().map(move |part| format!(" {letter}{part}({name})")))
                .collect::<String>()
        };
        let _ = writeln!(text, ".print {kind}{}{}", of('v', nodes), of('i', sources));
    }
    text
}

/// Volts per unit of a signal: a micrometre, a milliradian, a kelvin, a femtocoulomb, a femtofarad or a micronewton is a volt.
pub(super) fn scale(signal: &str) -> f64 {
    match signal.rsplit_once('.').map_or("", |(_, quantity)| quantity) {
        "x" | "y" | "gap" | "F" => 1e6,
        "rz" => 1e3,
        "q" | "C" => 1e15,
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One line for a kind, however many analyses of it there are.
    #[test]
    fn one_line_for_each_kind() {
        let lines = [".op", ".ac dec 1 1 10", ".ac dec 9 1 10"].map(str::to_owned);
        assert_eq!(
            prints(&lines, &["x", "a"], &["v_s"]),
            ".print op v(x) v(a) i(v_s)\n.print ac vm(x) vp(x) vm(a) vp(a) im(v_s) ip(v_s)\n"
        );
    }
}
