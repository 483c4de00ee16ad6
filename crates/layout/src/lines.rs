//! A mechanism as netlist lines without loops, parameters and subnets, as a drawing stores them in labels.
//!
//! A line is one element with its full name ("b1.hot") and all numbers in SI; a process is a material with its thickness.
//! [`from_structure`] makes lines of a [`Structure`](bimorph_structure::Structure), [`text`] a netlist of lines, in which
//! names with dots become subnets again; a line's own text is what stands in a label, and [`ElementLine::parse`] reads it back.

pub(crate) mod from_structure;
pub(crate) mod text;

use std::fmt;
use thiserror::Error;

/// Longest text of one label (bytes).
pub(crate) const LONGEST_LABEL: usize = 4096;

/// One element.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ElementLine {
    /// Full name, with those of the subnet instances around it.
    pub(crate) name: String,
    /// Element model ("beam2d").
    pub(crate) model: String,
    /// Process it is made of; `*`: none.
    pub(crate) process: String,
    /// Nodes, by full name.
    pub(crate) nodes: Vec<String>,
    /// Parameters.
    pub(crate) parameters: Vec<(String, f64)>,
    /// Parameters whose values are words, or curves over temperature.
    pub(crate) words: Vec<(String, String)>,
}

/// A material with its thickness.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ProcessLine {
    /// Its name.
    pub(crate) name: String,
    /// Entries as in netlists, SI.
    pub(crate) entries: Vec<(String, f64)>,
}

/// A mechanism.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct ElementLines {
    /// Materials.
    pub(crate) processes: Vec<ProcessLine>,
    /// Elements, in the order in which they place each other.
    pub(crate) elements: Vec<ElementLine>,
}

/// Why a label is no line.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("the label `{text}` is no netlist line: expected {expected}")]
pub struct LineError {
    /// The label, cut.
    pub text: String,
    /// The expected word.
    pub expected: &'static str,
}

impl ElementLine {
    /// A parameter's value.
    pub(crate) fn get(&self, name: &str) -> Option<f64> {
        self.parameters.iter().find(|(n, _)| n == name).map(|(_, v)| *v)
    }

    /// Sets a parameter.
    pub(crate) fn set(&mut self, name: &str, value: f64) {
        match self.parameters.iter_mut().find(|(n, _)| n == name) {
            Some((_, old)) => *old = value,
            None => self.parameters.push((name.to_owned(), value)),
        }
    }

    /// Reads `NAME MODEL PROCESS [nodes] [name=value …]`, all numbers plain.
    ///
    /// # Errors
    /// See [`LineError`].
    pub(crate) fn parse(text: &str) -> Result<Self, LineError> {
        let fault = |expected| LineError { text: text.chars().take(60).collect(), expected };
        if text.len() > LONGEST_LABEL {
            return Err(fault("at most 4096 bytes"));
        }
        let form = "NAME MODEL PROCESS [nodes] [name=value …]";
        let (head, rest) = text.split_once('[').ok_or_else(|| fault(form))?;
        let (nodes, rest) = rest.split_once(']').ok_or_else(|| fault(form))?;
        let words: Vec<&str> = head.split_whitespace().collect();
        let &[name, model, process] = words.as_slice() else {
            return Err(fault("a name, a model and a process before `[`"));
        };
        let nodes: Vec<String> = nodes.split_whitespace().map(str::to_owned).collect();
        let good = is_full_name(name) && is_name(model) && (process == "*" || is_name(process));
        if !good || nodes.is_empty() || !nodes.iter().all(|n| is_full_name(n)) {
            return Err(fault(
                "names of letters, digits, `_`, indices and dots, no words of the language, and at least one node",
            ));
        }
        let (parameters, words) =
            pairs(rest.trim()).ok_or_else(|| fault("[name=value …] with numbers or words behind the nodes"))?;
        let [name, model, process] = [name, model, process].map(str::to_owned);
        Ok(Self { name, model, process, nodes, parameters, words })
    }
}

impl ProcessLine {
    /// Reads `process NAME = [name=value …]`; none: the text is something else.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let rest = text.strip_prefix("process ")?;
        let (name, entries) = rest.split_once('=')?;
        let name = name.trim();
        let good = is_name(name) && text.len() <= LONGEST_LABEL;
        good.then_some(())?;
        let (entries, words) = pairs(entries.trim())?;
        words.is_empty().then(|| Self { name: name.to_owned(), entries })
    }
}

/// Parameters whose values are words.
const WORDED: [&str; 2] = ["fringe", "electrode"];

/// Numbers and words of a list, in its order.
type ParameterPairs = (Vec<(String, f64)>, Vec<(String, String)>);

/// `[a=1 b=2 c=word]`.
fn pairs(text: &str) -> Option<ParameterPairs> {
    let inside = text.strip_prefix('[')?.strip_suffix(']')?;
    let mut found = ParameterPairs::default();
    for word in inside.split_whitespace() {
        let (name, value) = word.split_once('=').filter(|(name, _)| is_name(name))?;
        match value.parse::<f64>() {
            Ok(number) if number.is_finite() => found.0.push((name.to_owned(), number)),
            Err(_) if WORDED.contains(&name) && is_name(value) || is_curve(value) => {
                found.1.push((name.to_owned(), value.to_owned()));
            }
            _ => return None,
        }
    }
    Some(found)
}

/// A curve over temperature: `table(1,2,3,4)` or `polynomial(1,2)`.
fn is_curve(text: &str) -> bool {
    let numbers = ["table(", "polynomial("].iter().find_map(|name| text.strip_prefix(name)?.strip_suffix(')'));
    numbers.is_some_and(|numbers| numbers.split(',').all(|x| x.parse::<f64>().is_ok_and(f64::is_finite)))
}

/// Words that mean something else in a netlist than a name.
pub(crate) const RESERVED: [&str; 9] = ["subnet", "param", "process", "for", "if", "else", "call", "uses", "pi"];

/// A word of netlists that is a name.
pub(crate) fn is_name(text: &str) -> bool {
    !RESERVED.contains(&text)
        && text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
}

/// Words with whole indices, joined by dots: "q.A.b(1).hot", "D(1,2)".
pub(crate) fn is_full_name(text: &str) -> bool {
    text.split('.').all(|part| {
        let (word, index) = part.split_once('(').map_or((part, None), |(w, i)| (w, Some(i)));
        let whole = |i: &str| {
            let digits = i.strip_prefix('-').unwrap_or(i);
            !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())
        };
        is_name(word) && index.is_none_or(|i| i.strip_suffix(')').is_some_and(|i| i.split(',').all(whole)))
    })
}

fn write_pairs(f: &mut fmt::Formatter<'_>, pairs: &[(String, f64)], words: &[(String, String)]) -> fmt::Result {
    f.write_str("[")?;
    for (k, (name, value)) in pairs.iter().enumerate() {
        let blank = if k > 0 { " " } else { "" };
        write!(f, "{blank}{name}={}", ExactNumber(*value))?;
    }
    for (k, (name, word)) in words.iter().enumerate() {
        let blank = if k + pairs.len() > 0 { " " } else { "" };
        write!(f, "{blank}{name}={word}")?;
    }
    f.write_str("]")
}

/// A number that reads back to the same bits in netlists: 2e-6, 0.5, 400.
pub(crate) struct ExactNumber(pub(crate) f64);

impl fmt::Display for ExactNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.abs();
        if self.0 == 0.0 {
            f.write_str("0")
        } else if (1e-3..1e6).contains(&size) {
            write!(f, "{}", self.0)
        } else {
            write!(f, "{:e}", self.0)
        }
    }
}

impl fmt::Display for ElementLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, model, process, nodes, parameters, words } = self;
        write!(f, "{name} {model} {process} [{}] ", nodes.join(" "))?;
        write_pairs(f, parameters, words)
    }
}

impl fmt::Display for ProcessLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "process {} = ", self.name)?;
        write_pairs(f, &self.entries, &[])
    }
}

#[cfg(test)]
mod tests {
    //! Lines round-trip, and malformed lines are reported.
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn lines_read_back() {
        let text = "q.b(1).hot beam2det p1 [a(1) q.t] [l=2.06e-4 w=2e-6 oz=-1.5707963267948966 R=0 n=400]";
        assert_eq!(ElementLine::parse(text).unwrap().to_string(), text);
        let worded = "g gap2dforce * [a b c d] [l=0.5 fringe=none]";
        assert_eq!(ElementLine::parse(worded).unwrap().to_string(), worded);
        let process = "process p1 = [Youngsmodulus=1.65e11 density=2300]";
        assert_eq!(ProcessLine::parse(process).unwrap().to_string(), process);
        for wrong in [
            "yoke",
            "a beam2d p [",
            "a beam2d [b] []",
            "a b p [] []",
            "a b p [c] [fringe=1x]",
            "a b p [c] [l=x]",
            "a b p [c(x)] []",
            "a b p [c] [l=inf]",
        ] {
            assert!(ElementLine::parse(wrong).is_err(), "{wrong}");
        }
    }

    proptest! {
        #[test]
        fn any_text_parses_or_is_refused(text in ".{0,80}") {
            let _ = (ElementLine::parse(&text), ProcessLine::parse(&text));
        }

        #[test]
        fn numbers_keep_their_bits(bits in any::<u64>()) {
            let value = f64::from_bits(bits);
            if value.is_finite() {
                prop_assert_eq!(ExactNumber(value).to_string().parse::<f64>().unwrap(), value);
            }
        }
    }
}
