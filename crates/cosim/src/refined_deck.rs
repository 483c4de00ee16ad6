//! A deck made finer: half the longest step in every transient, and a tenth of `reltol`; and a deck that also writes down what its
//! `.control` section computed.
//!
//! ngspice takes the last `.options` that names a thing, and where `.tran` gives no longest step the smaller of its
//! step and a fiftieth of its time. Changes are made in the deck itself; an included file is used as it is, and a note
//! says so where it matters.

use std::path::Path;

/// How many times smaller `reltol` and each model's tolerance become (1).
pub const TIGHTER: f64 = 10.0;
/// By how much the longest step becomes shorter (1).
const STEP_SHARE: f64 = 0.5;
/// ngspice's `reltol` where a deck says nothing (1).
const DEFAULT_RELTOL: f64 = 1e-3;
/// Steps that ngspice takes at least, where `.tran` gives no longest one.
const MIN_STEPS: f64 = 50.0;

/// A deck changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RefinedDeck {
    /// Its text.
    pub text: String,
    /// Parts that could not be refined, one sentence each.
    pub notes: Vec<String>,
}

/// The deck with shorter steps and tighter tolerances. `folder`: where it stands.
pub fn finer(deck: &str, folder: &Path) -> RefinedDeck {
    let mut notes = Vec::new();
    let (mut lines, mut control, mut tightened) = (Vec::new(), false, false);
    for (n, line) in logical_lines(deck).into_iter().enumerate() {
        let word = line.split_whitespace().next().unwrap_or("").to_ascii_lowercase();
        let step = if control { "tran" } else { ".tran" };
        let changed = match word.as_str() {
            _ if n == 0 => None,
            ".control" => {
                control = true;
                None
            }
            ".endc" => {
                control = false;
                None
            }
            word if word == step => {
                let halved = halved(&line, control);
                if halved.is_none() {
                    notes.push(format!("the steps of \"{}\" are not numbers here: they stay as they are", line.trim()));
                }
                halved
            }
            ".options" | ".option" | ".opt" | "option" | "options" | "set" => {
                let changed = tightened_line(&line);
                tightened |= changed.is_some() && !control;
                changed
            }
            ".include" | ".inc" | ".lib" => {
                if included(&line, folder).is_some_and(|text| decides(&text)) {
                    notes.push(format!("\"{}\": the analyses and options in there stay as they are", line.trim()));
                }
                None
            }
            _ => None,
        };
        lines.push(changed.unwrap_or(line));
    }
    if !tightened && !lines.is_empty() {
        lines.insert(1, format!(".options reltol={}", written(DEFAULT_RELTOL / TIGHTER)));
    }
    RefinedDeck { text: lines.join("\n") + "\n", notes }
}

/// The deck with every plot of its `.control` sections appended to `raw` at their end, and before each `quit`. A deck without such a
/// section stays as it is.
pub fn keeping_plots(deck: &str, raw: &Path) -> String {
    let keep = keep(raw);
    let is = |line: &str, words: &[&str]| {
        let word = line.split_whitespace().next().unwrap_or("");
        words.iter().any(|w| word.eq_ignore_ascii_case(w))
    };
    let last = deck.lines().enumerate().filter(|(_, line)| is(line, &[".endc"])).map(|(n, _)| n).last();
    let mut text = String::new();
    let mut control = false;
    for (n, line) in deck.lines().enumerate() {
        control = (control || is(line, &[".control"])) && !is(line, &[".endc"]);
        if Some(n) == last || (control && is(line, &["quit", "exit"])) {
            text += &keep;
            text.push('\n');
        }
        text += line;
        text.push('\n');
    }
    text
}

/// Text of the file that a line includes, where it can be read.
fn included(line: &str, folder: &Path) -> Option<String> {
    let file = words(line).into_iter().nth(1)?;
    std::fs::read_to_string(folder.join(file.trim_matches(['"', '\'']))).ok()
}

/// Whether an included text has something that would be made finer.
fn decides(text: &str) -> bool {
    let text = text.to_ascii_lowercase();
    text.contains("reltol") || text.lines().any(|l| l.starts_with(".tran"))
}

/// Commands that append every plot there is to a file.
fn keep(raw: &Path) -> String {
    format!(
        "set appendwrite\nforeach bimorph_plot $plots\nsetplot $bimorph_plot\nwrite {}\nend\nunset appendwrite",
        raw.display()
    )
}

/// The deck with a `.control` section that runs it and keeps its plots, where it has `.measure` lines and no such section: ngspice
/// measures nothing while it writes a raw file by itself.
pub fn measuring(deck: &str, raw: &Path) -> Option<String> {
    let begins = |words: &[&str]| {
        let of =
            |line: &&str| words.iter().any(|w| line.get(..w.len()).is_some_and(|head| head.eq_ignore_ascii_case(w)));
        deck.lines().any(|line| of(&line))
    };
    if !begins(&[".meas"]) || begins(&[".control"]) {
        return None;
    }
    let lines: Vec<&str> = deck.lines().collect();
    let end = lines.iter().rposition(|line| line.trim().eq_ignore_ascii_case(".end")).unwrap_or(lines.len());
    let section = format!(".control\nrun\n{}\nquit\n.endc\n.end\n", keep(raw));
    Some(lines[..end].join("\n") + "\n" + &section)
}

/// Lines with their continuations (`+`) put behind them; comments and empty lines between them stand before.
pub(super) fn logical_lines(deck: &str) -> Vec<String> {
    let (mut lines, mut last): (Vec<String>, Option<usize>) = (Vec::new(), None);
    for (number, line) in deck.lines().enumerate() {
        let text = line.trim_start();
        match (text.strip_prefix('+'), last) {
            (Some(rest), Some(last)) => {
                lines[last].push(' ');
                lines[last].push_str(rest);
            }
            _ => {
                // the first line is a title, whatever it begins with
                if number > 0 && !text.is_empty() && !text.starts_with('*') {
                    last = Some(lines.len());
                }
                lines.push(line.to_owned());
            }
        }
    }
    lines
}

/// Words of a line; what stands in braces or quotes is one.
fn words(line: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let (mut depth, mut quoted, mut open) = (0u32, false, false);
    for c in line.chars() {
        match c {
            '{' | '(' if !quoted => depth += 1,
            '}' | ')' if !quoted => depth = depth.saturating_sub(1),
            '\'' => quoted = !quoted,
            _ => {}
        }
        if c.is_whitespace() && depth == 0 && !quoted {
            open = false;
        } else if open {
            if let Some(word) = words.last_mut() {
                word.push(c);
            }
        } else {
            words.push(c.to_string());
            open = true;
        }
    }
    words
}

/// A number as decks write it: a suffix of SPICE, and letters behind it that mean nothing.
pub fn number(word: &str) -> Option<f64> {
    let end = word
        .char_indices()
        .find(|&(i, c)| {
            let after_e = i > 0 && word[..i].ends_with(['e', 'E']);
            let exponent = matches!(c, 'e' | 'E')
                && i > 0
                && word[i + 1..].trim_start_matches(['+', '-']).starts_with(|d: char| d.is_ascii_digit());
            !(c.is_ascii_digit() || c == '.' || (matches!(c, '+' | '-') && (i == 0 || after_e)) || exponent)
        })
        .map_or(word.len(), |(i, _)| i);
    let value: f64 = word[..end].parse().ok()?;
    let suffix = word[end..].to_ascii_lowercase();
    if !suffix.chars().all(|c| c.is_ascii_alphabetic()) {
        return None;
    }
    let factor = match suffix.as_bytes() {
        [b'm', b'e', b'g', ..] => 1e6,
        [b'm', b'i', b'l', ..] => 25.4e-6,
        [first, ..] => match first {
            b't' => 1e12,
            b'g' => 1e9,
            b'k' => 1e3,
            b'm' => 1e-3,
            b'u' => 1e-6,
            b'n' => 1e-9,
            b'p' => 1e-12,
            b'f' => 1e-15,
            b'a' => 1e-18,
            _ => 1.0,
        },
        [] => 1.0,
    };
    Some(value * factor)
}

/// A number for a deck: twelve digits, so that 20n/2 is 1e-8.
fn written(value: f64) -> String {
    let rounded: f64 = format!("{value:.11e}").parse().unwrap_or(value);
    format!("{rounded:e}")
}

/// A word in braces or quotes, or a number: anything that can be part of an expression.
fn expression(word: &str) -> Option<String> {
    let inner = |open: char, close: char| word.strip_prefix(open).and_then(|w| w.strip_suffix(close));
    if let Some(value) = number(word) {
        return Some(written(value));
    }
    inner('{', '}').or_else(|| inner('\'', '\'')).map(|w| format!("({w})"))
}

/// A `.tran` line with half the longest step; `None` where its steps cannot be determined.
fn halved(line: &str, control: bool) -> Option<String> {
    let words = words(line);
    let uic = words.iter().skip(1).position(|w| w.eq_ignore_ascii_case("uic")).map(|n| n + 1);
    let times = &words[1..uic.unwrap_or(words.len())];
    let (step, stop) = (times.first()?, times.get(1)?);
    let start = times.get(2).map_or("0", String::as_str);
    let numbers: Option<Vec<f64>> = times.iter().map(|w| number(w)).collect();
    let longest = match (numbers, times.get(3)) {
        (Some(numbers), Some(_)) => written(STEP_SHARE * numbers[3]),
        (Some(numbers), None) => {
            let span = numbers[1] - numbers.get(2).copied().unwrap_or(0.0);
            written(STEP_SHARE * numbers[0].min(span / MIN_STEPS))
        }
        (None, _) if control => return None,
        (None, Some(longest)) => format!("{{{STEP_SHARE}*{}}}", expression(longest)?),
        (None, None) => {
            let (step, stop, start) = (expression(step)?, expression(stop)?, expression(start)?);
            format!("{{{STEP_SHARE}*min({step},({stop}-{start})/{MIN_STEPS})}}")
        }
    };
    let tail = if uic.is_some() { " uic" } else { "" };
    Some(format!("{} {step} {stop} {start} {longest}{tail}", words[0]))
}

/// A line with a tenth of its `reltol`; `None` without a `reltol` of known value.
fn tightened_line(line: &str) -> Option<String> {
    let at = line.to_ascii_lowercase().find("reltol")?;
    let (head, rest) = line.split_at(at + "reltol".len());
    let value = rest.trim_start().strip_prefix('=')?.trim_start();
    let word = words(value).into_iter().next()?;
    let smaller = match number(&word) {
        Some(value) => written(value / TIGHTER),
        None => format!("{{{}/{TIGHTER}}}", expression(&word)?),
    };
    Some(format!("{head}={smaller}{}", &value[word.len()..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The longest step is halved, whether it is given or follows ngspice's rule, in numbers and in expressions; `uic` stays.
    #[test]
    fn steps_are_halved() {
        let of = |line: &str| halved(line, false).unwrap();
        assert_eq!(of(".tran 1u 1m"), ".tran 1u 1m 0 5e-7");
        assert_eq!(of(".TRAN 100u 1m"), ".TRAN 100u 1m 0 1e-5");
        assert_eq!(of(".tran 20n 90us 0 20n uic"), ".tran 20n 90us 0 1e-8 uic");
        assert_eq!(of(".tran {h} {10*h} 0 {h / 2}"), ".tran {h} {10*h} 0 {0.5*(h / 2)}");
        assert_eq!(of(".tran {h} 1m"), ".tran {h} 1m 0 {0.5*min((h),(1e-3-0e0)/50)}");
        assert_eq!(halved("tran $h 1m", true), None);
    }

    /// `reltol` becomes a tenth wherever it stands, and is added where it stands nowhere.
    #[test]
    fn reltol_is_a_tenth() {
        let of = |text: &str| finer(text, Path::new(".")).text;
        assert_eq!(of("t\n.options gmin=1e-12 RELTOL = 1e-5 x=1\n"), "t\n.options gmin=1e-12 RELTOL=1e-6 x=1\n");
        assert_eq!(of("t\n.options a\n+ reltol={r}\n"), "t\n.options a  reltol={(r)/10}\n");
        assert_eq!(of("t\nR1 a 0 1\n"), "t\n.options reltol=1e-4\nR1 a 0 1\n");
    }

    /// A control section's commands are refined too, and unchangeable ones are reported.
    #[test]
    fn control_sections_are_read() {
        let deck =
            "t\n.options reltol=1e-3\n.control\ntran 1u 1m\ntran $a 1m\nset reltol=1e-4\n.endc\n.include x.inc\n";
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("x.inc"), "* more\n.tran 1u 1m\n").unwrap();
        let changed = finer(deck, folder.path());
        assert!(changed.text.contains("tran 1u 1m 0 5e-7\ntran $a 1m\nset reltol=1e-5\n"), "{}", changed.text);
        assert_eq!(changed.notes.len(), 2, "{:?}", changed.notes);
    }

    /// Plots are kept at the end of the last control section and before each `quit` in one.
    #[test]
    fn plots_are_kept() {
        let text = keeping_plots("t\n.control\nop\nquit\n.endc\n.end\n", Path::new("/x/k.raw"));
        assert_eq!(text.matches("write /x/k.raw").count(), 2, "{text}");
        assert_eq!(keeping_plots("t\nquit\n.op\n.end\n", Path::new("k")), "t\nquit\n.op\n.end\n");
    }

    /// A deck that measures gets a section of its own before its end, unless it has one.
    #[test]
    fn decks_that_measure_are_run_by_a_section() {
        let raw = Path::new("k.raw");
        let text = measuring("t\n.tran 1 2\n.MEAS tran a max v(x)\n.end\n", raw).unwrap();
        assert!(text.contains("max v(x)\n.control\nrun\n") && text.ends_with("quit\n.endc\n.end\n"), "{text}");
        assert_eq!(measuring("t\n.meas tran a max v(x)\n.control\nrun\n.endc\n", raw), None);
        assert_eq!(measuring("t\n.tran 1 2\n.end\n", raw), None);
    }

    /// A comment between continuations is not a continuation, and a continuation may follow blanks.
    #[test]
    fn comments_between_continuations() {
        let lines =
            logical_lines("* title\nV1 a 0 PULSE(0 4 1u\n* rise, fall\n+ 1u 1u 5u 20u)\n.model m x(\n\n  + y=1)\n.end");
        assert_eq!(
            lines,
            ["* title", "V1 a 0 PULSE(0 4 1u  1u 1u 5u 20u)", "* rise, fall", ".model m x(  y=1)", "", ".end"]
        );
    }

    /// Numbers are read as SPICE reads them.
    #[test]
    fn numbers_as_spice_reads_them() {
        for (text, value) in
            [("1u", 1e-6), ("2meg", 2e6), ("1e-3", 1e-3), ("5e3ohm", 5e3), ("10us", 1e-5), ("-3.5", -3.5)]
        {
            let got = number(text).unwrap();
            assert!((got / value - 1.0).abs() < 1e-15, "{text}: {got}");
        }
        assert_eq!((number("{x}"), number("$x"), number("1u*2")), (None, None, None));
    }
}
