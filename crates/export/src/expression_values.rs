//! Values of the expressions that files hold: numbers, variables, `+ - * /`, brackets and functions of SPICE and Verilog-A.

use std::collections::HashMap;

/// Variables with their values.
#[derive(Debug, Default)]
pub(super) struct ExpressionValues(HashMap<String, f64>);

impl ExpressionValues {
    /// Sets a variable to an expression of others.
    pub(super) fn set(&mut self, name: &str, text: &str) {
        let value = self.value(text);
        self.0.insert(name.to_owned(), value);
    }

    /// A variable.
    pub(super) fn of(&self, name: &str) -> f64 {
        self.0[name]
    }

    /// An expression, which must be read to its end.
    pub(super) fn value(&self, text: &str) -> f64 {
        let mut left = text;
        let value = self.sum(&mut left);
        assert_eq!(left.trim(), "", "{text}");
        value
    }

    fn sum(&self, text: &mut &str) -> f64 {
        let mut value = self.product(text);
        loop {
            *text = text.trim_start();
            match text.chars().next() {
                Some('+') => value += self.rest(text, Self::product),
                Some('-') => value -= self.rest(text, Self::product),
                _ => return value,
            }
        }
    }

    fn product(&self, text: &mut &str) -> f64 {
        let mut value = self.factor(text);
        loop {
            *text = text.trim_start();
            match text.chars().next() {
                Some('*') => value *= self.rest(text, Self::factor),
                Some('/') => value /= self.rest(text, Self::factor),
                _ => return value,
            }
        }
    }

    fn rest(&self, text: &mut &str, read: fn(&Self, &mut &str) -> f64) -> f64 {
        *text = &text[1..];
        read(self, text)
    }

    fn factor(&self, text: &mut &str) -> f64 {
        *text = text.trim_start();
        if text.starts_with('-') {
            return -self.rest(text, Self::factor);
        }
        let end = text.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(text.len());
        let name = &text[..end];
        if text[end..].starts_with('(') {
            *text = &text[end..];
            let mut values = vec![self.rest(text, Self::sum)];
            while text.starts_with(',') {
                values.push(self.rest(text, Self::sum));
            }
            *text = text.strip_prefix(')').unwrap_or_else(|| panic!("no bracket: {text}"));
            return match (name, values.as_slice()) {
                ("", [x]) => *x,
                ("ln", [x]) => x.ln(),
                ("exp", [x]) => x.exp(),
                ("abs", [x]) => x.abs(),
                ("sqrt", [x]) => x.sqrt(),
                ("min", [x, y]) => x.min(*y),
                ("max", [x, y]) => x.max(*y),
                ("pow", [x, y]) => x.powf(*y),
                _ => panic!("no function of SPICE and Verilog-A: {name}"),
            };
        }
        if !name.is_empty() {
            *text = &text[end..];
            return *self.0.get(name).unwrap_or_else(|| panic!("no variable: {name}"));
        }
        let end = (1..=text.len())
            .rev()
            .find(|end| text[..*end].parse::<f64>().is_ok())
            .unwrap_or_else(|| panic!("no number: {text}"));
        let value = text[..end].parse().unwrap();
        *text = &text[end..];
        value
    }
}
