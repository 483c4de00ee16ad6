//! Sums of quantities with numeric factors, by name: `top.C-bot.C`, `0.5*a.x + 0.5*b.x`.
//!
//! ```text
//! sum    = [sign] term { sign term }          sign = "+" | "-"
//! term   = factor { "*" factor | "/" number }
//! factor = number | name                      one name in each term
//! ```
//! Spaces are skipped. Parts in parentheses or brackets belong to a name, such as `x1(1).y` and `b[2].x`. A name that the model has is that
//! quantity, even with signs in it. All quantities of a sum have the same unit.

use super::ReadoutError;
use std::ops::{Add, Mul};

/// Largest number of terms of a sum.
pub const MAX_TERMS: usize = 100;

/// Something with a unit.
pub trait Quantity {
    /// Its unit.
    fn unit(&self) -> &'static str;
}

/// A sum of quantities of the same unit, each with a factor.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression<T> {
    first: (f64, T),
    others: Vec<(f64, T)>,
}

impl<T> From<T> for Expression<T> {
    fn from(quantity: T) -> Self {
        Self { first: (1.0, quantity), others: Vec::new() }
    }
}

impl<T: Quantity> Expression<T> {
    /// The quantity of that name or, where `find` has none, the sum that the text describes.
    ///
    /// # Errors
    /// [`ReadoutError::UnknownSignal`], [`ReadoutError::BadExpression`].
    pub fn find(text: &str, find: impl Fn(&str) -> Result<T, ReadoutError>) -> Result<Self, ReadoutError> {
        let unknown = match find(text) {
            Ok(quantity) => return Ok(quantity.into()),
            Err(error) => error,
        };
        let Some(terms) = terms(text)? else { return Err(unknown) };
        let mut found = Vec::with_capacity(terms.len());
        for (factor, name) in terms {
            bimorph_base::budget::check();
            found.push((factor, find(name)?, name));
        }
        let unit = found[0].1.unit();
        if let Some((_, other, name)) = found.iter().find(|(_, quantity, _)| quantity.unit() != unit) {
            let (own, other) = (found[0].2, other.unit());
            return Err(bad(
                text,
                format!("expected quantities of the same unit, got {own} [{unit}] and {name} [{other}]"),
            ));
        }
        let mut found = found.into_iter().map(|(factor, quantity, _)| (factor, quantity));
        let first = found.next().ok_or(unknown)?;
        Ok(Self { first, others: found.collect() })
    }

    /// Its unit.
    pub fn unit(&self) -> &'static str {
        self.first.1.unit()
    }
}

impl<T> Expression<T> {
    /// The quantities.
    pub fn quantities(&self) -> impl Iterator<Item = &T> {
        std::iter::once(&self.first).chain(&self.others).map(|(_, quantity)| quantity)
    }

    /// The sum of a value of each quantity. A quantity alone keeps the bits of its value.
    pub fn sum<V: Mul<f64, Output = V> + Add<Output = V>>(&self, mut of: impl FnMut(&T) -> V) -> V {
        let mut term = |(factor, quantity): &(f64, T)| of(quantity) * *factor;
        let first = term(&self.first);
        self.others.iter().fold(first, |sum, other| sum + term(other))
    }

    /// The same as [`Self::sum`] of magnitudes: an upper bound of the sum of errors.
    pub fn bound(&self, mut of: impl FnMut(&T) -> f64) -> f64 {
        let mut term = |(factor, quantity): &(f64, T)| factor.abs() * of(quantity);
        let first = term(&self.first);
        self.others.iter().fold(first, |sum, other| sum + term(other))
    }

    /// The same sum of other quantities.
    pub fn map<U>(&self, of: impl Fn(&T) -> U) -> Expression<U> {
        let term = |(factor, quantity): &(f64, T)| (*factor, of(quantity));
        Expression { first: term(&self.first), others: self.others.iter().map(term).collect() }
    }
}

fn bad(text: &str, detail: String) -> ReadoutError {
    ReadoutError::BadExpression { text: text.to_owned(), detail }
}

/// Factors and names of a sum; none for a text without signs and factors.
fn terms(text: &str) -> Result<Option<Vec<(f64, &str)>>, ReadoutError> {
    let pieces = pieces(text);
    if pieces.iter().all(|(sign, _)| *sign == ' ') {
        return Ok(None);
    }
    let mut terms: Vec<(f64, Option<&str>)> = Vec::new();
    for (k, (operator, piece)) in pieces.iter().enumerate() {
        // a sign in front of the first term
        if k == 0 && piece.is_empty() && pieces.get(1).is_some_and(|(next, _)| matches!(next, '+' | '-')) {
            continue;
        }
        if piece.is_empty() {
            return Err(bad(text, format!("expected a signal or a number after \"{operator}\"")));
        }
        if matches!(operator, '+' | '-' | ' ') {
            if terms.len() == MAX_TERMS {
                return Err(bad(text, format!("expected at most {MAX_TERMS} terms")));
            }
            terms.push((if *operator == '-' { -1.0 } else { 1.0 }, None));
        }
        let Some(term) = terms.last_mut() else { return Err(bad(text, "expected a term first".into())) };
        match (piece.parse::<f64>(), operator) {
            (Ok(number), '/') => term.0 /= number,
            (Ok(number), _) => term.0 *= number,
            (Err(_), '/') => return Err(bad(text, format!("expected a number after \"/\", got \"{piece}\""))),
            (Err(_), _) if term.1.is_some() => {
                return Err(bad(
                    text,
                    "expected one signal in each term: products of signals are not supported".into(),
                ));
            }
            (Err(_), _) => term.1 = Some(piece),
        }
        if !term.0.is_finite() {
            return Err(bad(text, format!("the factor at \"{piece}\" is not finite")));
        }
    }
    let named: Option<Vec<_>> = terms.into_iter().map(|(factor, name)| Some((factor, name?))).collect();
    named.map(Some).ok_or_else(|| bad(text, "expected a signal in each term".into()))
}

/// The text between operators, each with the operator before it; that of the first is a space.
fn pieces(text: &str) -> Vec<(char, &str)> {
    let (mut pieces, mut depth, mut start, mut operator) = (Vec::new(), 0_usize, 0, ' ');
    for (at, c) in text.char_indices() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth = depth.saturating_sub(1),
            '+' | '-' | '*' | '/' if depth == 0 && !exponent(&text[start..at]) => {
                pieces.push((operator, text[start..at].trim()));
                (operator, start) = (c, at + 1);
            }
            _ => {}
        }
    }
    pieces.push((operator, text[start..].trim()));
    pieces
}

/// The names in a sum, in its order; of a text without signs and factors the text.
pub fn names(text: &str) -> impl Iterator<Item = &str> {
    pieces(text).into_iter().map(|(_, piece)| piece).filter(|piece| piece.parse::<f64>().is_err())
}

/// The sum with other names; one for which `rename` has none stays.
pub fn renamed(text: &str, rename: impl Fn(&str) -> Option<String>) -> String {
    let mut out = String::with_capacity(text.len());
    for (k, (operator, piece)) in pieces(text).into_iter().enumerate() {
        if k > 0 {
            out.push(operator);
        }
        let other = if piece.parse::<f64>().is_ok() { None } else { rename(piece) };
        out.push_str(other.as_deref().unwrap_or(piece));
    }
    out
}

/// True where the text is a number up to its exponent, whose sign follows.
fn exponent(text: &str) -> bool {
    let digits = text.trim_start().strip_suffix(['e', 'E']);
    digits.is_some_and(|digits| {
        digits.ends_with(|c: char| c.is_ascii_digit() || c == '.') && digits.parse::<f64>().is_ok()
    })
}

#[cfg(test)]
mod tests {
    //! Sums are read with their signs and factors, and invalid ones are rejected by the part that is wrong.
    use super::*;

    #[derive(Debug, PartialEq)]
    struct Named(String);

    impl Quantity for Named {
        fn unit(&self) -> &'static str {
            if self.0.ends_with(".C") { "F" } else { "m" }
        }
    }

    fn find(name: &str) -> Result<Named, ReadoutError> {
        match name.rsplit_once('.') {
            Some((part, "x" | "y" | "C")) if !part.contains(['*', ' ']) && !part.contains('+') => {
                Ok(Named(name.into()))
            }
            _ => Err(ReadoutError::UnknownSignal { name: name.into(), hint: "none".into() }),
        }
    }

    fn read(text: &str) -> Vec<(f64, String)> {
        let found = Expression::find(text, find).unwrap_or_else(|error| panic!("{text}: {error}"));
        std::iter::once(found.first).chain(found.others).map(|(factor, name)| (factor, name.0)).collect()
    }

    #[test]
    fn sums_are_read() {
        let own = |factor: f64, name: &str| (factor, name.to_owned());
        assert_eq!(read("a.x"), [own(1.0, "a.x")]);
        // `a-b.x` is a name of this model
        assert_eq!(read("a-b.x"), [own(1.0, "a-b.x")]);
        assert_eq!(read("top.C+ -1*bot.C".replace("+ -", "-").as_str()), [own(1.0, "top.C"), own(-1.0, "bot.C")]);
        assert_eq!(read(" 0.5*a.x + b.x*2e-3/4"), [own(0.5, "a.x"), own(0.0005, "b.x")]);
        assert_eq!(read("-x1(1,-2).y+b[2].x*1E+3"), [own(-1.0, "x1(1,-2).y"), own(1000.0, "b[2].x")]);
        assert_eq!(read("+2*3*a.x*1"), [own(6.0, "a.x")]);
        // a node may be called as an exponent ends
        assert_eq!(read("1e.x+e.x"), [own(1.0, "1e.x"), own(1.0, "e.x")]);
    }

    #[test]
    fn names_are_replaced() {
        let text = "-0.5*a.x + x1(1,-2).y/2e-3";
        assert_eq!(names(text).filter(|name| !name.is_empty()).collect::<Vec<_>>(), ["a.x", "x1(1,-2).y"]);
        assert_eq!(renamed(text, |name| (name == "a.x").then(|| "A.x".into())), "-0.5*A.x+x1(1,-2).y/2e-3");
        assert_eq!(renamed("a.x", |_| None), "a.x");
    }

    #[test]
    fn invalid_sums_are_rejected() {
        let reason = |text: &str| Expression::find(text, find).unwrap_err().to_string();
        assert_eq!(reason("a.z"), "signal \"a.z\": none");
        assert_eq!(reason("2*a.x+3*a.z"), "signal \"a.z\": none");
        for (text, part) in [
            ("a.x++b.x", "after \"+\""),
            ("a.x+", "after \"+\""),
            ("2*", "after \"*\""),
            ("*a.x", "after"),
            ("a.x*b.x+c.x", "products of signals"),
            ("2+a.x*1", "a signal in each term"),
            ("2*a.x/b.x", "a number after \"/\""),
            ("2*a.x/0", "not finite"),
            ("1e999*a.x", "not finite"),
            ("2*top.C-1*a.x", "top.C [F] and a.x [m]"),
        ] {
            let said = reason(text);
            assert!(said.contains(part) && said.contains(text), "{text}: {said}");
        }
        let long = vec!["1*a.x"; MAX_TERMS + 1].join("+");
        assert!(reason(&long).contains("at most"), "{}", reason(&long));
        assert_eq!(read(&vec!["1*a.x"; MAX_TERMS].join("+")).len(), MAX_TERMS);
    }
}
