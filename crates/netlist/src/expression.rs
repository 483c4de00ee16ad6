//! Expressions, by operator precedence: `|`, `&`, comparisons, `+ -`, `* /`, unary `- !`, `^`, all left associative.

use super::ast::{Binary, Expr, ExprKind, Ident};
use super::parser::{Parsed, Parser};
use super::source::TextSpan;
use super::token::{Lexeme, TokenKind};

/// Operators, calls and brackets that one expression may hold: bounds the depth of its tree.
const LARGEST_EXPRESSION: usize = 500;

/// How strongly unary `-` and `!` bind: below `^`, above `* /`.
const UNARY: u8 = 6;

fn binary(kind: TokenKind) -> Option<(Binary, u8)> {
    Some(match kind {
        TokenKind::Or => (Binary::Or, 1),
        TokenKind::And => (Binary::And, 2),
        TokenKind::Equal => (Binary::Equal, 3),
        TokenKind::NotEqual => (Binary::NotEqual, 3),
        TokenKind::Less => (Binary::Less, 3),
        TokenKind::LessEqual => (Binary::LessEqual, 3),
        TokenKind::Greater => (Binary::Greater, 3),
        TokenKind::GreaterEqual => (Binary::GreaterEqual, 3),
        TokenKind::Plus => (Binary::Add, 4),
        TokenKind::Minus => (Binary::Subtract, 4),
        TokenKind::Star => (Binary::Multiply, 5),
        TokenKind::Slash => (Binary::Divide, 5),
        TokenKind::Caret => (Binary::Power, 7),
        _ => return None,
    })
}

impl Parser<'_> {
    /// One whole expression.
    pub(super) fn expression(&mut self) -> Parsed<Expr> {
        self.outermost(|p| p.climb(0))
    }

    /// Runs `parse` with a fresh count of the expression's size.
    pub(super) fn outermost<T>(&mut self, parse: impl FnOnce(&mut Self) -> Parsed<T>) -> Parsed<T> {
        let outer = std::mem::replace(&mut self.nodes, 0);
        let result = parse(self);
        self.nodes = outer;
        result
    }

    fn count(&mut self) -> Parsed<()> {
        self.nodes += 1;
        if self.nodes > LARGEST_EXPRESSION {
            let span = self.peek().span;
            let message = format!("an expression with more than {LARGEST_EXPRESSION} operators and brackets");
            return Err(self.sink.error("E018", span, message, "split it with intermediate definitions"));
        }
        Ok(())
    }

    /// Everything that binds more strongly than `above`.
    fn climb(&mut self, above: u8) -> Parsed<Expr> {
        let mut left = self.prefix()?;
        while let Some((operator, strength)) = binary(self.peek().kind)
            && strength > above
        {
            self.count()?;
            self.next();
            let right = self.climb(strength)?;
            let span = left.span.to(right.span);
            left = Expr { kind: ExprKind::Binary(operator, Box::new(left), Box::new(right)), span };
        }
        Ok(left)
    }

    fn prefix(&mut self) -> Parsed<Expr> {
        let token = self.peek();
        let kind = match token.kind {
            TokenKind::Number(value) => ExprKind::Number(value),
            TokenKind::Text => {
                let quoted = self.text_of(token.span);
                let text = quoted.trim_end_matches(['"', '\'']).get(1..).unwrap_or("");
                ExprKind::Text(self.word(text))
            }
            TokenKind::Identifier => return self.variable_or_call(),
            TokenKind::Minus | TokenKind::Not => {
                self.count()?;
                self.next();
                let operand = Box::new(self.climb(UNARY)?);
                let span = token.span.to(operand.span);
                let negate = token.kind == TokenKind::Minus;
                let kind = if negate { ExprKind::Negate(operand) } else { ExprKind::Not(operand) };
                return Ok(Expr { kind, span });
            }
            TokenKind::Open => {
                self.count()?;
                self.next();
                let inner = self.climb(0)?;
                let close = self.expect(TokenKind::Close, "`)`")?;
                return Ok(Expr { span: token.span.to(close.span), ..inner });
            }
            TokenKind::Plus => {
                let help = "a number has no leading `+`";
                return Err(self.sink.error("E010", token.span, "expected a value, found `+`".into(), help));
            }
            _ => return Err(self.unexpected("a value")),
        };
        self.next();
        Ok(Expr { kind, span: token.span })
    }

    fn variable_or_call(&mut self) -> Parsed<Expr> {
        let name = self.ident("a value")?;
        match self.eat(TokenKind::Open) {
            Some(open) => self.call(name, open),
            None => Ok(Expr { span: name.span, kind: ExprKind::Variable(name.name, super::ast::Slot::NONE) }),
        }
    }

    /// A call whose opening bracket was read.
    pub(super) fn call(&mut self, function: Ident, open: Lexeme) -> Parsed<Expr> {
        self.count()?;
        let (arguments, close) = self.arguments(open)?;
        Ok(Expr { span: function.span.to(close), kind: ExprKind::Call(function.name, arguments) })
    }

    /// Values up to the closing bracket, and the place of that bracket.
    pub(super) fn arguments(&mut self, _open: Lexeme) -> Parsed<(Vec<Expr>, TextSpan)> {
        let mut arguments = Vec::new();
        if let Some(close) = self.eat(TokenKind::Close) {
            return Ok((arguments, close.span));
        }
        loop {
            arguments.push(self.climb(0)?);
            if let Some(close) = self.eat(TokenKind::Close) {
                return Ok((arguments, close.span));
            }
            self.expect(TokenKind::Comma, "`,` or `)`")?;
        }
    }
}
