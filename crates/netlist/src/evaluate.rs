//! Values of expressions in the frame at hand.

use super::ast::{Binary, Expr, ExprKind};
use super::diagnostic_sink::Reported;
use super::elaborate::Elaborator;
use super::functions;
use super::source::TextSpan;
use super::value::Value;

impl<'p> Elaborator<'p> {
    pub(super) fn evaluate(&mut self, expr: &'p Expr) -> Result<Value, Reported> {
        self.steps += 1;
        match &expr.kind {
            ExprKind::Number(x) => Ok(Value::Number(*x)),
            ExprKind::Text(text) => Ok(Value::Text(text.clone())),
            ExprKind::Undefined => Ok(Value::Undefined),
            ExprKind::Variable(_, slot) => match self.variable(*slot) {
                Value::Failed => Err(Reported),
                value => Ok(value.clone()),
            },
            ExprKind::Negate(operand) => Ok(Value::Number(-self.number(operand, "-")?)),
            ExprKind::Not(operand) => Ok((self.number(operand, "!")? == 0.0).into()),
            ExprKind::Binary(operator, left, right) => self.binary(*operator, left, right, expr.span),
            ExprKind::Call(name, arguments) => self.call(name, arguments, expr.span),
        }
    }

    /// The value of an operand that must be a number.
    fn number(&mut self, expr: &'p Expr, operator: &str) -> Result<f64, Reported> {
        match self.evaluate(expr)? {
            Value::Number(x) => Ok(x),
            other => Err(self.operand(&other, expr, operator)),
        }
    }

    fn operand(&mut self, value: &Value, expr: &Expr, operator: &str) -> Reported {
        let help = match (&expr.kind, value) {
            (ExprKind::Variable(name, _), Value::Undefined) => {
                format!("`{name}` has no value here; test it with `isdef`")
            }
            _ => String::new(),
        };
        let message = format!("`{operator}` needs a number, this is {}", value.called());
        self.sink.error("E040", expr.span, message, help)
    }

    fn binary(&mut self, operator: Binary, left: &'p Expr, right: &'p Expr, span: TextSpan) -> Result<Value, Reported> {
        let sign = match operator {
            Binary::Add => "+",
            Binary::Subtract => "-",
            Binary::Multiply => "*",
            Binary::Divide => "/",
            Binary::Power => "^",
            Binary::Equal => "==",
            Binary::NotEqual => "!=",
            Binary::Less => "<",
            Binary::LessEqual => "<=",
            Binary::Greater => ">",
            Binary::GreaterEqual => ">=",
            Binary::And => "&",
            Binary::Or => "|",
        };
        match operator {
            Binary::And if self.number(left, sign)? == 0.0 => return Ok(false.into()),
            Binary::And => return Ok((self.number(right, sign)? != 0.0).into()),
            Binary::Or if self.number(left, sign)? != 0.0 => return Ok(true.into()),
            Binary::Or => return Ok((self.number(right, sign)? != 0.0).into()),
            _ => {}
        }
        let (a, b) = (self.evaluate(left)?, self.evaluate(right)?);
        let (x, y) = match (&a, &b) {
            (Value::Number(x), Value::Number(y)) => (*x, *y),
            (Value::Text(x), Value::Text(y)) if operator == Binary::Equal => return Ok((x == y).into()),
            (Value::Text(x), Value::Text(y)) if operator == Binary::NotEqual => return Ok((x != y).into()),
            (Value::Number(_), _) => return Err(self.operand(&b, right, sign)),
            _ => return Err(self.operand(&a, left, sign)),
        };
        let number = match operator {
            Binary::Add => x + y,
            Binary::Subtract => x - y,
            Binary::Multiply => x * y,
            Binary::Divide if y == 0.0 => return Err(self.sink.error("E041", span, "division by zero".into(), "")),
            Binary::Divide => x / y,
            Binary::Power => x.powf(y),
            Binary::Equal => return Ok((x == y).into()),
            Binary::NotEqual => return Ok((x != y).into()),
            Binary::Less => return Ok((x < y).into()),
            Binary::LessEqual => return Ok((x <= y).into()),
            Binary::Greater => return Ok((x > y).into()),
            Binary::GreaterEqual | Binary::And | Binary::Or => return Ok((x >= y).into()),
        };
        if number.is_nan() {
            return Err(self.sink.error("E041", span, format!("`{sign}` has no real value here"), ""));
        }
        Ok(Value::Number(number))
    }

    fn call(&mut self, name: &str, arguments: &'p [Expr], span: TextSpan) -> Result<Value, Reported> {
        match (name, arguments) {
            ("cond", [condition, yes, no]) => {
                let branch = if self.number(condition, "cond")? == 0.0 { no } else { yes };
                return self.evaluate(branch);
            }
            ("isdef", [argument]) => return Ok((self.evaluate(argument)? != Value::Undefined).into()),
            ("print", _) => {
                let mut line = String::new();
                for argument in arguments {
                    line.push_str(&self.evaluate(argument)?.to_string());
                }
                self.sink.output("W002", span, format!("print: {line}"));
                return Ok(Value::Number(0.0));
            }
            ("assert", [condition, text]) => {
                let text = self.evaluate(text)?.to_string();
                if self.number(condition, "assert")? == 0.0 {
                    return Err(self.sink.error("E042", span, text, "the netlist's own `assert` failed"));
                }
                return Ok(Value::Number(0.0));
            }
            ("cond", _) => return Err(self.sink.error("E043", span, "`cond` takes three arguments".into(), "")),
            ("isdef", _) => return Err(self.sink.error("E043", span, "`isdef` takes one argument".into(), "")),
            ("assert", _) => {
                let help = "write `assert(condition, 'text')`";
                return Err(self.sink.error("E043", span, "`assert` takes a condition and a string".into(), help));
            }
            _ => {}
        }
        let mut values = Vec::with_capacity(arguments.len());
        for argument in arguments {
            values.push(self.evaluate(argument)?);
        }
        functions::apply(name, &values).map_err(|message| self.sink.error("E043", span, message, ""))
    }
}
