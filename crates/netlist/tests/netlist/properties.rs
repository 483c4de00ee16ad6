//! Properties that hold for every text: reading never panics, and expressions mean what their tree says.

use bimorph_base::{Bundle, Setting};
use bimorph_netlist::load;
use proptest::prelude::*;

/// Loads a text and renders every message, whatever comes of it.
fn survive(text: &str) {
    match load(&Bundle::from_text("t.net", text), &[]) {
        Ok(loaded) => drop(loaded.warnings.render(true)),
        Err(diagnostics) => {
            assert!(diagnostics.has_errors());
            drop(diagnostics.render(false));
        }
    }
}

/// Words of the language, put together at random.
fn words() -> impl Strategy<Value = String> {
    let word = prop::sample::select(vec![
        "subnet",
        "param",
        "process",
        "for",
        "if",
        "else",
        "call",
        "uses",
        "uses x.net",
        "anchor",
        "beam2d",
        "f2d",
        "gap2d",
        "port",
        "pos",
        "spring2d",
        "p1",
        "parent",
        "*",
        "?",
        "[",
        "]",
        "[",
        "]",
        "(",
        ")",
        "=",
        "==",
        "!=",
        "<",
        ":",
        ",",
        "+",
        "-",
        "/",
        "^",
        "&",
        "|",
        "!",
        "10u",
        "2",
        "0",
        "1.5e-3u",
        "10um",
        ".5",
        "'a'",
        "\"b",
        "x",
        "a",
        "b",
        "l=10u",
        "w=2u",
        "[a b]",
        "[l=10u w=2u]",
        "k=1:3",
        "pi",
        "sqrt(2)",
        "isdef(x)",
        "cond(1,2,3)",
        "print(1)",
        "% c\n",
        "\n",
        "µ",
        "{",
        "process p1 = [Youngsmodulus=1e11 density=1 h=1u]",
        "anchor p1 [a] []",
        "beam2d p1 [a b] [l=1u w=1u]",
    ]);
    prop::collection::vec(word, 0..60).prop_map(|words| words.join(" "))
}

/// An expression as a tree, with its value.
#[derive(Debug, Clone)]
enum ExpressionTree {
    Number(u16),
    Negate(Box<ExpressionTree>),
    Not(Box<ExpressionTree>),
    Binary(usize, Box<ExpressionTree>, Box<ExpressionTree>),
}

/// Sign, strength and meaning.
type ExpressionOperator = (&'static str, u8, fn(f64, f64) -> f64);

/// The binary operators.
const OPERATORS: [ExpressionOperator; 11] = [
    ("|", 1, |a, b| f64::from(a != 0.0 || b != 0.0)),
    ("&", 2, |a, b| f64::from(a != 0.0 && b != 0.0)),
    ("==", 3, |a, b| f64::from(a == b)),
    ("!=", 3, |a, b| f64::from(a != b)),
    ("<", 3, |a, b| f64::from(a < b)),
    (">=", 3, |a, b| f64::from(a >= b)),
    ("+", 4, |a, b| a + b),
    ("-", 4, |a, b| a - b),
    ("*", 5, |a, b| a * b),
    ("/", 5, |a, b| a / b),
    ("^", 7, f64::powf),
];
const UNARY: u8 = 6;
const ATOM: u8 = 9;

impl ExpressionTree {
    fn value(&self) -> f64 {
        match self {
            Self::Number(n) => f64::from(*n),
            Self::Negate(a) => -a.value(),
            Self::Not(a) => f64::from(a.value() == 0.0),
            Self::Binary(o, a, b) => OPERATORS[*o].2(a.value(), b.value()),
        }
    }

    fn strength(&self) -> u8 {
        match self {
            Self::Number(_) => ATOM,
            Self::Negate(_) | Self::Not(_) => UNARY,
            Self::Binary(o, ..) => OPERATORS[*o].1,
        }
    }

    /// The text with brackets only where the grammar needs them.
    fn sparse(&self) -> String {
        let at_least = |tree: &Self, strength: u8| {
            if tree.strength() >= strength { tree.sparse() } else { format!("({})", tree.sparse()) }
        };
        match self {
            Self::Number(n) => n.to_string(),
            Self::Negate(a) => format!("-{}", at_least(a, UNARY)),
            Self::Not(a) => format!("!{}", at_least(a, UNARY)),
            // Left associative: an operand of the same strength needs brackets on the right only. A unary operator on
            // the left reaches as far right as it can, so it is bracketed before anything stronger.
            Self::Binary(o, a, b) => {
                let (sign, strength, _) = OPERATORS[*o];
                format!("{} {sign} {}", at_least(a, strength), at_least(b, strength + 1))
            }
        }
    }

    /// The text with brackets everywhere.
    fn full(&self) -> String {
        match self {
            Self::Number(n) => n.to_string(),
            Self::Negate(a) => format!("(-{})", a.full()),
            Self::Not(a) => format!("(!{})", a.full()),
            Self::Binary(o, a, b) => format!("({} {} {})", a.full(), OPERATORS[*o].0, b.full()),
        }
    }
}

fn tree() -> impl Strategy<Value = ExpressionTree> {
    (0u16..6).prop_map(ExpressionTree::Number).prop_recursive(5, 40, 2, |inner| {
        prop_oneof![
            inner.clone().prop_map(|a| ExpressionTree::Negate(Box::new(a))),
            inner.clone().prop_map(|a| ExpressionTree::Not(Box::new(a))),
            (0..OPERATORS.len(), inner.clone(), inner).prop_map(|(o, a, b)| ExpressionTree::Binary(
                o,
                Box::new(a),
                Box::new(b)
            )),
        ]
    })
}

fn value(text: &str) -> Option<f64> {
    let loaded = load(&Bundle::from_text("t.net", &format!("param value = {text}")), &[]).ok()?;
    match loaded.parameters.as_slice() {
        [(_, Setting::Number(x))] => Some(*x),
        _ => None,
    }
}

/// Divisions by zero and powers without a real value are errors of the language: they have no value to compare.
fn regular(tree: &ExpressionTree) -> bool {
    match tree {
        ExpressionTree::Number(_) => true,
        ExpressionTree::Negate(a) | ExpressionTree::Not(a) => regular(a),
        ExpressionTree::Binary(o, a, b) => {
            let no_value = OPERATORS[*o].0 == "/" && b.value() == 0.0;
            regular(a) && regular(b) && !no_value && !tree.value().is_nan()
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    /// Any text at all is read to its end.
    #[test]
    fn any_text(text in "\\PC{0,200}") {
        survive(&text);
    }

    /// Any sequence of the language's own words is read to its end.
    #[test]
    fn any_words(text in words()) {
        survive(&text);
    }

    /// Any cut through a sound netlist is read to its end.
    #[test]
    fn any_cut(from in 0usize..600, to in 0usize..600) {
        let text = include_str!("../../../../tests/netlists/bank.net");
        let cut = |at: usize| (0..=at.min(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0);
        let (from, to) = (cut(from), cut(to));
        survive(&text[from.min(to)..from.max(to)]);
    }

    /// Precedence and associativity: an expression with few brackets and one with all of them have the tree's value.
    #[test]
    fn expressions(tree in tree()) {
        prop_assume!(regular(&tree));
        let want = tree.value().to_bits();
        // A logical operator may skip an operand, but never changes a value by that.
        prop_assert_eq!(value(&tree.full()).map(f64::to_bits), Some(want), "{}", tree.full());
        prop_assert_eq!(value(&tree.sparse()).map(f64::to_bits), Some(want), "{}", tree.sparse());
    }

    /// A number with a suffix is the decimal number it spells, rounded once.
    #[test]
    fn suffixed_numbers(whole in 0u32..100_000, part in 0u32..1000, letter in 0usize..6) {
        let (suffix, power) = [("u", -6), ("n", -9), ("p", -12), ("m", -3), ("k", 3), ("G", 9)][letter];
        let want: f64 = format!("{whole}.{part}e{power}").parse().expect("decimal");
        prop_assert_eq!(value(&format!("{whole}.{part}{suffix}")), Some(want));
    }
}
