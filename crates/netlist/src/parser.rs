//! Tokens → syntax tree, by recursive descent. Included files are read where they are named.

use super::ast::{Ident, Program, Statement};
use super::diagnostic_sink::{DiagnosticSink, Reported};
use super::foreign;
use super::includes::{DEEPEST_INCLUDE, MAX_INCLUDES};
use super::lexer;
use super::source::TextSpan;
use super::token::{Lexeme, TokenKind};
use bimorph_base::Bundle;
use std::collections::HashMap;
use std::sync::Arc;

/// Blocks, conditions and loops may nest this deep.
const DEEPEST_NESTING: usize = 100;
/// File that a netlist uses to declare `ox oy oz` in degrees, unless a file of that name exists.
const DEGREES: &str = "degrees.net";

/// Parses a bundle. Every syntax error goes to the sink.
pub(crate) fn parse(bundle: &Bundle, sink: &mut DiagnosticSink) -> Program {
    let mut parser = Parser {
        bundle,
        sink,
        text: "",
        tokens: Vec::new(),
        at: 0,
        blocks: Vec::new(),
        depth: 0,
        includes: 0,
        leaving: false,
        nodes: 0,
        anonymous: 0,
        words: HashMap::new(),
        program: Program::default(),
    };
    let mut statements = Vec::new();
    parser.file(&bundle.root, 0, &mut statements);
    parser.program.statements = statements;
    parser.program
}

pub(super) struct Parser<'a> {
    pub(super) bundle: &'a Bundle,
    pub(super) sink: &'a mut DiagnosticSink,
    pub(super) text: &'a str,
    pub(super) tokens: Vec<Lexeme>,
    pub(super) at: usize,
    /// Opening brackets of the blocks being read, outermost first.
    pub(super) blocks: Vec<Lexeme>,
    pub(super) depth: usize,
    includes: usize,
    /// True while an unclosed block is being left for the top level of its file.
    pub(super) leaving: bool,
    /// Operators, calls and brackets of the expression at hand.
    pub(super) nodes: usize,
    pub(super) anonymous: usize,
    words: HashMap<&'a str, Arc<str>>,
    pub(super) program: Program,
}

/// A syntax error was reported; the caller skips to where parsing can continue.
pub(super) type Parsed<T> = Result<T, Reported>;

impl<'a> Parser<'a> {
    // ---- tokens ----

    pub(super) fn peek(&self) -> Lexeme {
        self.ahead(0)
    }

    pub(super) fn ahead(&self, n: usize) -> Lexeme {
        let last = self.tokens.len() - 1;
        self.tokens[(self.at + n).min(last)]
    }

    pub(super) fn next(&mut self) -> Lexeme {
        let token = self.peek();
        self.at = (self.at + 1).min(self.tokens.len() - 1);
        token
    }

    pub(super) fn eat(&mut self, kind: TokenKind) -> Option<Lexeme> {
        (self.peek().kind == kind).then(|| self.next())
    }

    pub(super) fn expect(&mut self, kind: TokenKind, wanted: &str) -> Parsed<Lexeme> {
        if self.peek().kind == kind { Ok(self.next()) } else { Err(self.unexpected(wanted)) }
    }

    pub(super) fn unexpected(&mut self, wanted: &str) -> Reported {
        let token = self.peek();
        let found = match token.kind {
            TokenKind::Identifier | TokenKind::Number(_) | TokenKind::Text => format!("`{}`", self.text_of(token.span)),
            kind => kind.called().to_owned(),
        };
        self.sink.error("E010", token.span, format!("expected {wanted}, found {found}"), "")
    }

    pub(super) fn text_of(&self, span: TextSpan) -> &'a str {
        self.text.get(span.start as usize..span.end as usize).unwrap_or("")
    }

    pub(super) fn word(&mut self, text: &'a str) -> Arc<str> {
        Arc::clone(self.words.entry(text).or_insert_with(|| Arc::from(text)))
    }

    pub(super) fn ident(&mut self, wanted: &str) -> Parsed<Ident> {
        let token = self.expect(TokenKind::Identifier, wanted)?;
        Ok(Ident { name: self.word(self.text_of(token.span)), span: token.span })
    }

    // ---- files ----

    fn file(&mut self, name: &str, depth: usize, out: &mut Vec<Statement>) {
        let Some(text) = self.bundle.files.get(name) else { return };
        let number = u16::try_from(self.includes).unwrap_or(u16::MAX);
        match foreign::kind(text, number) {
            foreign::FileKind::Lua(span) => {
                let message = format!("`{name}` is a SUGAR 3 (Lua) netlist");
                let help = if cfg!(feature = "lua") {
                    "a SUGAR 2 netlist can use SUGAR 2 files only"
                } else {
                    "this build reads SUGAR 2 only: convert it, or build with the feature `lua`"
                };
                self.sink.error("E005", span, message, help);
                return;
            }
            foreign::FileKind::Matlab(span) => {
                let message = format!("`{name}` is a MATLAB file, not a netlist");
                let help = "a netlist is what such a file loads with `cho_load`: name that one";
                self.sink.error("E006", span, message, help);
                return;
            }
            foreign::FileKind::Netlist => {}
        }
        let tokens = lexer::tokens(number, text, self.sink);
        let outer = (
            std::mem::replace(&mut self.tokens, tokens),
            std::mem::replace(&mut self.at, 0),
            std::mem::replace(&mut self.text, text),
            std::mem::replace(&mut self.depth, 0),
            std::mem::take(&mut self.blocks),
        );
        while self.peek().kind != TokenKind::End {
            bimorph_base::budget::check();
            self.leaving = false;
            if let Some(close) = self.eat(TokenKind::CloseList) {
                self.sink.error("E011", close.span, "this `]` closes nothing".into(), "");
                continue;
            }
            self.statement_or_skip(true, depth, out);
        }
        self.leaving = false;
        (self.tokens, self.at, self.text, self.depth, self.blocks) = outer;
    }

    fn uses(&mut self, depth: usize, out: &mut Vec<Statement>) {
        let token = self.next();
        let name = lexer::used_name(self.text_of(token.span));
        if name.is_empty() {
            self.sink.error("E020", token.span, "`uses` names no file".into(), "write `uses FILE`");
            return;
        }
        if name == DEGREES && !self.bundle.files.contains_key(name) {
            if !self.program.degrees.contains(&token.span.file) {
                self.program.degrees.push(token.span.file);
            }
            return;
        }
        let root = self.bundle.root.as_str();
        if self.sink.files.iter().any(|f| f == name) && name != root {
            return;
        }
        if !self.bundle.files.contains_key(name) || name == root {
            self.program.incomplete = true;
            let own = name == root || root.ends_with(&format!("/{name}"));
            if own {
                self.sink.error("E022", token.span, format!("`{name}` includes itself"), "remove this line");
            } else {
                let help = "it is looked for in this file's folder, the working directory and the include folders";
                self.sink.error("E021", token.span, format!("cannot find the file `{name}`"), help);
            }
        } else if depth >= DEEPEST_INCLUDE {
            self.sink.error(
                "E023",
                token.span,
                format!("files include each other more than {DEEPEST_INCLUDE} deep"),
                "",
            );
        } else if self.includes >= MAX_INCLUDES {
            self.sink.error("E024", token.span, format!("more than {MAX_INCLUDES} included files"), "");
        } else {
            self.includes += 1;
            self.sink.files.push(name.to_owned());
            self.file(name, depth + 1, out);
        }
    }

    // ---- statements ----

    pub(super) fn statement_or_skip(&mut self, top: bool, depth: usize, out: &mut Vec<Statement>) {
        if self.peek().kind == TokenKind::Uses {
            return self.uses(depth, out);
        }
        let before = self.at;
        let result = match self.peek().kind {
            TokenKind::Param | TokenKind::Process | TokenKind::Subnet if !top => {
                let token = self.peek();
                let opened = self.blocks.last().map_or(0, |open| self.line_of(open.span));
                let message = format!("{} stands inside a block", token.kind.called());
                let help = format!("is a `]` missing above? the block was opened in line {opened}");
                self.sink.error("E012", token.span, message, help);
                self.leaving = true;
                return;
            }
            TokenKind::Param => self.param(out),
            TokenKind::Process => self.process().map(|p| out.push(p)),
            TokenKind::Subnet => self.subnet().map(|s| out.push(s)),
            _ => self.line().map(|s| out.push(s)),
        };
        if result.is_err() && !self.leaving {
            self.recover(before);
        }
    }

    fn line_of(&self, span: TextSpan) -> usize {
        self.text.get(..span.start as usize).map_or(0, |before| before.matches('\n').count() + 1)
    }

    /// Skips the rest of a statement with an error: to a word that can only begin a statement, to the first word of a
    /// line that resembles one, or to the end of the enclosing block.
    fn recover(&mut self, before: usize) {
        let opened = |kind: TokenKind| i64::from(kind == TokenKind::OpenList) - i64::from(kind == TokenKind::CloseList);
        let mut open: i64 = self.tokens[before..self.at].iter().map(|t| opened(t.kind)).sum();
        if self.at == before {
            open += opened(self.next().kind).max(0);
        }
        loop {
            let token = self.peek();
            let done = match token.kind {
                TokenKind::End => true,
                TokenKind::CloseList => open <= 0,
                kind if kind.begins_statement() => token.starts_line || open <= 0,
                TokenKind::Identifier => token.starts_line && (open <= 0 || self.element_ahead()),
                TokenKind::OpenList => token.starts_line && open <= 0,
                _ => false,
            };
            if done {
                return;
            }
            open += opened(self.next().kind);
        }
    }

    /// True when the tokens ahead look like the head of an element: two or three words, then a list.
    fn element_ahead(&self) -> bool {
        let word = |n: usize| matches!(self.ahead(n).kind, TokenKind::Identifier | TokenKind::Star);
        word(1) && (self.ahead(2).kind == TokenKind::OpenList || (word(2) && self.ahead(3).kind == TokenKind::OpenList))
    }

    /// True when a new statement begins here, on a line of its own: inside a list, its `]` is missing.
    pub(super) fn statement_ahead(&self) -> bool {
        let token = self.peek();
        token.starts_line && (token.kind.begins_statement() || self.element_ahead())
    }

    pub(super) fn nested<T>(&mut self, parse: impl FnOnce(&mut Self) -> Parsed<T>) -> Parsed<T> {
        if self.depth >= DEEPEST_NESTING {
            let span = self.peek().span;
            let message = format!("blocks nest more than {DEEPEST_NESTING} deep");
            return Err(self.sink.error("E013", span, message, "split the netlist into subnets"));
        }
        self.depth += 1;
        let result = parse(self);
        self.depth -= 1;
        result
    }
}
