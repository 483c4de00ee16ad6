//! Tokens → syntax tree, by recursive descent. Included files are read where they are named.

use super::ast::{Def, Element, Expr, ExprKind, Formal, Ident, Layer, LayerRef, Name, Program, Slot, Statement, Subnet};
use super::bundle::{Bundle, DEEPEST_INCLUDE, MOST_INCLUDES};
use super::lexer;
use super::sink::{Reported, Sink};
use super::source::Span;
use super::token::{Kind, Token};
use std::collections::HashMap;
use std::rc::Rc;

/// Blocks, conditions and loops may nest this deep.
const DEEPEST_NESTING: usize = 100;

/// Parses a bundle. Every syntax error goes to the sink.
pub(crate) fn parse(bundle: &Bundle, sink: &mut Sink) -> Program {
    let mut parser = Parser {
        bundle,
        sink,
        text: "",
        tokens: Vec::new(),
        at: 0,
        file: 0,
        depth: 0,
        includes: 0,
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
    pub(super) sink: &'a mut Sink,
    pub(super) text: &'a str,
    pub(super) tokens: Vec<Token>,
    pub(super) at: usize,
    file: u16,
    depth: usize,
    includes: usize,
    /// Operators, calls and brackets of the expression at hand.
    pub(super) nodes: usize,
    anonymous: usize,
    words: HashMap<&'a str, Rc<str>>,
    program: Program,
}

/// A syntax error was reported; the caller skips to where reading can go on.
pub(super) type Parsed<T> = Result<T, Reported>;

impl<'a> Parser<'a> {
    // ---- tokens ----

    pub(super) fn peek(&self) -> Token {
        self.ahead(0)
    }

    pub(super) fn ahead(&self, n: usize) -> Token {
        let last = self.tokens.len() - 1;
        self.tokens[(self.at + n).min(last)]
    }

    pub(super) fn next(&mut self) -> Token {
        let token = self.peek();
        self.at = (self.at + 1).min(self.tokens.len() - 1);
        token
    }

    pub(super) fn eat(&mut self, kind: Kind) -> Option<Token> {
        (self.peek().kind == kind).then(|| self.next())
    }

    pub(super) fn expect(&mut self, kind: Kind, wanted: &str) -> Parsed<Token> {
        if self.peek().kind == kind { Ok(self.next()) } else { Err(self.unexpected(wanted)) }
    }

    pub(super) fn unexpected(&mut self, wanted: &str) -> Reported {
        let token = self.peek();
        let found = match token.kind {
            Kind::Identifier | Kind::Number(_) | Kind::Text => format!("`{}`", self.text_of(token.span)),
            kind => kind.called().to_owned(),
        };
        self.sink.error("E010", token.span, format!("expected {wanted}, found {found}"), "")
    }

    pub(super) fn text_of(&self, span: Span) -> &'a str {
        self.text.get(span.start as usize..span.end as usize).unwrap_or("")
    }

    pub(super) fn word(&mut self, text: &'a str) -> Rc<str> {
        Rc::clone(self.words.entry(text).or_insert_with(|| Rc::from(text)))
    }

    pub(super) fn ident(&mut self, wanted: &str) -> Parsed<Ident> {
        let token = self.expect(Kind::Identifier, wanted)?;
        Ok(Ident { name: self.word(self.text_of(token.span)), span: token.span })
    }

    // ---- files ----

    fn file(&mut self, name: &str, depth: usize, out: &mut Vec<Statement>) {
        let Some(text) = self.bundle.files.get(name) else { return };
        let number = u16::try_from(self.includes).unwrap_or(u16::MAX);
        let tokens = lexer::tokens(number, text, self.sink);
        let outer = (
            std::mem::replace(&mut self.tokens, tokens),
            std::mem::replace(&mut self.at, 0),
            std::mem::replace(&mut self.text, text),
            std::mem::replace(&mut self.file, number),
            std::mem::replace(&mut self.depth, 0),
        );
        while self.peek().kind != Kind::End {
            if let Some(close) = self.eat(Kind::CloseList) {
                self.sink.error("E011", close.span, "this `]` closes nothing".into(), "");
                continue;
            }
            self.statement_or_skip(true, depth, out);
        }
        (self.tokens, self.at, self.text, self.file, self.depth) = outer;
    }

    fn uses(&mut self, depth: usize, out: &mut Vec<Statement>) {
        let token = self.next();
        let name = lexer::used_name(self.text_of(token.span));
        if name.is_empty() {
            self.sink.error("E020", token.span, "`uses` names no file".into(), "write `uses FILE`");
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
            self.sink.error("E023", token.span, format!("files include each other more than {DEEPEST_INCLUDE} deep"), "");
        } else if self.includes >= MOST_INCLUDES {
            self.sink.error("E024", token.span, format!("more than {MOST_INCLUDES} included files"), "");
        } else {
            self.includes += 1;
            self.sink.files.push(name.to_owned());
            self.file(name, depth + 1, out);
        }
    }

    // ---- statements ----

    fn statement_or_skip(&mut self, top: bool, depth: usize, out: &mut Vec<Statement>) {
        if self.peek().kind == Kind::Uses {
            return self.uses(depth, out);
        }
        let before = self.at;
        let result = match self.peek().kind {
            Kind::Param | Kind::Process | Kind::Subnet if !top => {
                let token = self.peek();
                let message = format!("{} stands inside a block", token.kind.called());
                Err(self.sink.error("E012", token.span, message, "move it out of all `[ ]`"))
            }
            Kind::Param => self.param(out),
            Kind::Process => self.process().map(|p| out.push(p)),
            Kind::Subnet => self.subnet().map(|s| out.push(s)),
            _ => self.line().map(|s| out.push(s)),
        };
        if result.is_err() {
            self.recover(before);
        }
    }

    /// Skips what is left of a statement with an error: to a word that can only begin a statement, or to the first
    /// word of a line that looks like one, or to the end of the enclosing block.
    fn recover(&mut self, before: usize) {
        let opened = |kind: Kind| i64::from(kind == Kind::OpenList) - i64::from(kind == Kind::CloseList);
        let mut open: i64 = self.tokens[before..self.at].iter().map(|t| opened(t.kind)).sum();
        if self.at == before {
            open += opened(self.next().kind).max(0);
        }
        loop {
            let token = self.peek();
            let done = match token.kind {
                Kind::End => true,
                Kind::CloseList => open <= 0,
                kind if kind.begins_statement() => token.starts_line || open <= 0,
                Kind::Identifier => token.starts_line && (open <= 0 || self.element_ahead()),
                Kind::OpenList => token.starts_line && open <= 0,
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
        let word = |n: usize| matches!(self.ahead(n).kind, Kind::Identifier | Kind::Star);
        word(1) && (self.ahead(2).kind == Kind::OpenList || (word(2) && self.ahead(3).kind == Kind::OpenList))
    }

    fn nested<T>(&mut self, parse: impl FnOnce(&mut Self) -> Parsed<T>) -> Parsed<T> {
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

    fn line(&mut self) -> Parsed<Statement> {
        match self.peek().kind {
            Kind::OpenList => Ok(Statement::Block(self.block()?)),
            Kind::For => self.nested(Self::for_loop),
            Kind::If => self.nested(Self::condition),
            Kind::Call => {
                self.next();
                let function = self.ident("the function to call")?;
                let open = self.expect(Kind::Open, "`(`")?;
                Ok(Statement::Call(self.outermost(|p| p.call(function, open))?))
            }
            Kind::Identifier if self.ahead(1).kind == Kind::Equals => Ok(Statement::Def(self.def()?)),
            Kind::Identifier => Ok(Statement::Element(Box::new(self.element()?))),
            _ => Err(self.unexpected("a statement")),
        }
    }

    fn block(&mut self) -> Parsed<Vec<Statement>> {
        self.nested(|p| {
            let open = p.expect(Kind::OpenList, "a block `[ … ]`")?;
            let mut out = Vec::new();
            loop {
                match p.peek().kind {
                    Kind::CloseList => {
                        p.next();
                        return Ok(out);
                    }
                    Kind::End => return Err(p.unclosed(open)),
                    _ => p.statement_or_skip(false, 0, &mut out),
                }
            }
        })
    }

    fn unclosed(&mut self, open: Token) -> Reported {
        self.sink.error("E014", open.span, "this `[` is never closed".into(), "every `[` needs its `]`")
    }

    fn for_loop(&mut self) -> Parsed<Statement> {
        self.next();
        let index = self.ident("the loop's variable")?;
        self.expect(Kind::Equals, "`=`")?;
        let from = self.expression()?;
        self.expect(Kind::Colon, "`:` between the first and the last value")?;
        let to = self.expression()?;
        let body = self.block()?;
        Ok(Statement::For { index, slot: Slot::NONE, from, to, body })
    }

    fn condition(&mut self) -> Parsed<Statement> {
        self.next();
        let condition = self.expression()?;
        let then = Box::new(self.line()?);
        let otherwise = match self.eat(Kind::Else) {
            Some(_) => Some(Box::new(self.line()?)),
            None => None,
        };
        Ok(Statement::If { condition, then, otherwise })
    }

    fn def(&mut self) -> Parsed<Def> {
        let name = self.ident("a name")?;
        self.expect(Kind::Equals, "`=`")?;
        Ok(Def { name, slot: Slot::NONE, value: self.expression()? })
    }

    fn param(&mut self, out: &mut Vec<Statement>) -> Parsed<()> {
        self.next();
        loop {
            let name = self.ident("the parameter's name")?;
            let default = match self.eat(Kind::Equals) {
                Some(_) => Some(self.expression()?),
                None => None,
            };
            out.push(Statement::Param { name, slot: Slot::NONE, default });
            if self.eat(Kind::Comma).is_none() {
                return Ok(());
            }
        }
    }

    fn process(&mut self) -> Parsed<Statement> {
        self.next();
        let name = self.ident("the layer's name")?;
        let parent_name = match self.eat(Kind::Colon) {
            Some(_) => Some(self.ident("the parent layer's name")?),
            None => None,
        };
        self.expect(Kind::Equals, "`=`")?;
        let (entries, _) = self.def_list()?;
        self.program.layers.push(Layer { name, parent_name, parent: None, entries, constant: false });
        Ok(Statement::Process(self.program.layers.len() - 1))
    }

    fn subnet(&mut self) -> Parsed<Statement> {
        self.next();
        let name = self.ident("the subnet's name")?;
        let (nodes, _) = self.name_list()?;
        let open = self.expect(Kind::OpenList, "`[` of the parameter list")?;
        let mut formals = Vec::new();
        while self.eat(Kind::CloseList).is_none() {
            let name = self.list_name(open)?;
            self.expect(Kind::Equals, "`=` and a default, `*` (must be given) or `?` (may stay open)")?;
            let mark = self.peek();
            let default = match mark.kind {
                Kind::Star => None,
                Kind::Question => Some(Expr { kind: ExprKind::Undefined, span: mark.span }),
                _ => Some(self.expression()?),
            };
            if matches!(mark.kind, Kind::Star | Kind::Question) {
                self.next();
            }
            formals.push(Formal { name, slot: Slot::NONE, default });
        }
        let body = self.block()?;
        self.program.subnets.push(Subnet { name, nodes, formals, body, variables: 0 });
        Ok(Statement::Subnet(self.program.subnets.len() - 1))
    }

    fn element(&mut self) -> Parsed<Element> {
        let first = self.ident("a statement")?;
        let mut name = None;
        let mut words = vec![first.clone()];
        if self.peek().kind == Kind::Open {
            name = Some(self.indices(first)?);
            words.clear();
        }
        while words.len() < 3 {
            match self.peek().kind {
                Kind::Identifier => words.push(self.ident("a name")?),
                Kind::Star => {
                    let span = self.next().span;
                    words.push(Ident { name: self.word("*"), span });
                    break;
                }
                _ => break,
            }
        }
        if words.len() == 3 && name.is_none() {
            let base = words.remove(0);
            name = Some(Name { span: base.span, base, indices: Vec::new() });
        }
        let (Ok([model, layer_name]), Kind::OpenList) = (<[Ident; 2]>::try_from(words), self.peek().kind) else {
            let help = "an element is `[NAME] MODEL LAYER [nodes] [parameters]`, with `*` for no layer";
            let span = self.peek().span;
            let found = self.peek().kind.called();
            return Err(self.sink.error("E015", span, format!("expected an element's model and layer, found {found}"), help));
        };
        let mut number = 0;
        if name.is_none() {
            self.anonymous += 1;
            number = self.anonymous;
        }
        let (nodes, nodes_span) = self.name_list()?;
        let (parameters, _) = self.def_list()?;
        let layer = LayerRef::None;
        Ok(Element { name, number, model, subnet: None, layer_name, layer, nodes, nodes_span, parameters })
    }

    // ---- lists ----

    fn indices(&mut self, base: Ident) -> Parsed<Name> {
        if self.peek().kind != Kind::Open {
            return Ok(Name { span: base.span, base, indices: Vec::new() });
        }
        let open = self.next();
        let (indices, close) = self.outermost(|p| p.arguments(open))?;
        if indices.is_empty() {
            return Err(self.sink.error("E016", close, "an index is missing".into(), "write a whole number"));
        }
        Ok(Name { span: base.span.to(close), base, indices })
    }

    fn name_list(&mut self) -> Parsed<(Vec<Name>, Span)> {
        let open = self.expect(Kind::OpenList, "`[` of the node list")?;
        let mut names = Vec::new();
        loop {
            match self.peek().kind {
                Kind::CloseList => {
                    let close = self.next();
                    return Ok((names, open.span.to(close.span)));
                }
                Kind::Comma => {
                    let comma = self.next();
                    self.sink.error("E017", comma.span, "node names are separated by blanks".into(), "remove the comma");
                }
                Kind::End => return Err(self.unclosed(open)),
                _ => {
                    let base = self.ident("a node name or `]`")?;
                    names.push(self.indices(base)?);
                }
            }
        }
    }

    fn def_list(&mut self) -> Parsed<(Vec<Def>, Span)> {
        let open = self.expect(Kind::OpenList, "`[` of the parameter list")?;
        let mut defs = Vec::new();
        loop {
            match self.peek().kind {
                Kind::CloseList => {
                    let close = self.next();
                    return Ok((defs, open.span.to(close.span)));
                }
                Kind::Comma => {
                    let comma = self.next();
                    self.sink.error("E017", comma.span, "parameters are separated by blanks".into(), "remove the comma");
                }
                _ => {
                    let name = self.list_name(open)?;
                    self.expect(Kind::Equals, &format!("`=` after the parameter `{}`", name.name))?;
                    defs.push(Def { name, slot: Slot::NONE, value: self.expression()? });
                }
            }
        }
    }

    /// The next name of a parameter list, or the error that the list was left open.
    fn list_name(&mut self, open: Token) -> Parsed<Ident> {
        let token = self.peek();
        if token.kind == Kind::End || (token.starts_line && (token.kind.begins_statement() || self.element_ahead())) {
            return Err(self.unclosed(open));
        }
        self.ident("a parameter name or `]`")
    }
}
