//! The grammar of statements: definitions, blocks, loops, conditions, layers, subnets, elements and their lists.

use super::ast::{
    Def, ElementStatement, Expr, ExprKind, Formal, Ident, LayerDefinition, LayerRef, Name, Slot, Statement,
    SubnetDefinition,
};
use super::diagnostic_sink::Reported;
use super::elements;
use super::parser::{Parsed, Parser};
use super::source::TextSpan;
use super::token::{Lexeme, TokenKind};
use std::collections::HashSet;
use std::sync::Arc;

/// Parameters of one element, layer or subnet.
const MAX_PARAMETERS: usize = 1000;

impl Parser<'_> {
    pub(super) fn line(&mut self) -> Parsed<Statement> {
        match self.peek().kind {
            TokenKind::OpenList => Ok(Statement::Block(self.block()?)),
            TokenKind::For => self.nested(Self::for_loop),
            TokenKind::If => self.nested(Self::condition),
            TokenKind::Call => {
                self.next();
                let function = self.ident("the function to call")?;
                let open = self.expect(TokenKind::Open, "`(`")?;
                Ok(Statement::Call(self.outermost(|p| p.call(function, open))?))
            }
            TokenKind::Identifier if self.ahead(1).kind == TokenKind::Equals => Ok(Statement::Def(self.def()?)),
            TokenKind::Identifier => {
                let element = self.element()?;
                self.stray_list();
                Ok(Statement::Element(Box::new(element)))
            }
            _ => Err(self.unexpected("a statement")),
        }
    }

    /// Warns of a list on an element's line that resembles parameters and is a block of definitions.
    fn stray_list(&mut self) {
        let open = self.peek();
        let entry = (self.ahead(1).kind, self.ahead(2).kind) == (TokenKind::Identifier, TokenKind::Equals);
        if open.kind != TokenKind::OpenList || open.starts_line || !entry {
            return;
        }
        let inside = (1..).map(|n| self.ahead(n).kind);
        let ends = inside
            .take_while(|kind| *kind != TokenKind::End)
            .find(|k| matches!(k, TokenKind::OpenList | TokenKind::CloseList));
        if ends == Some(TokenKind::CloseList) {
            let message = "a second list of definitions on an element's line is a block of its own".to_owned();
            self.sink.warning("W019", open.span, message, "an element has one list of parameters: put them into it");
        }
    }

    /// Warns of a name that a list has twice.
    fn twice<'n>(&mut self, names: impl Iterator<Item = &'n Ident>, what: &str, holds: &str) {
        let mut seen = HashSet::new();
        for name in names {
            if !seen.insert(Arc::clone(&name.name)) {
                let message = format!("the {what} `{}` stands twice in this list: the {holds} holds", name.name);
                self.sink.warning("W018", name.span, message, "remove one of them, or give it its own name");
            }
        }
    }

    fn block(&mut self) -> Parsed<Vec<Statement>> {
        self.nested(|p| {
            let open = p.expect(TokenKind::OpenList, "a block `[ … ]`")?;
            p.blocks.push(open);
            let mut out = Vec::new();
            let result = loop {
                if p.leaving {
                    break Err(Reported);
                }
                match p.peek().kind {
                    TokenKind::CloseList => {
                        p.next();
                        break Ok(out);
                    }
                    TokenKind::End => {
                        p.leaving = true;
                        break Err(p.unclosed(open));
                    }
                    _ => p.statement_or_skip(false, 0, &mut out),
                }
            };
            p.blocks.pop();
            result
        })
    }

    fn unclosed(&mut self, open: Lexeme) -> Reported {
        self.sink.error("E014", open.span, "this `[` is never closed".into(), "every `[` needs its `]`")
    }

    fn for_loop(&mut self) -> Parsed<Statement> {
        self.next();
        let index = self.ident("the loop's variable")?;
        self.expect(TokenKind::Equals, "`=`")?;
        let from = self.expression()?;
        self.expect(TokenKind::Colon, "`:` between the first and the last value")?;
        let to = self.expression()?;
        let body = self.block()?;
        Ok(Statement::For { index, slot: Slot::NONE, from, to, body })
    }

    fn condition(&mut self) -> Parsed<Statement> {
        self.next();
        let condition = self.expression()?;
        let then = Box::new(self.line()?);
        let otherwise = match self.eat(TokenKind::Else) {
            Some(_) => Some(Box::new(self.line()?)),
            None => None,
        };
        Ok(Statement::If { condition, then, otherwise })
    }

    fn def(&mut self) -> Parsed<Def> {
        let name = self.ident("a name")?;
        self.expect(TokenKind::Equals, "`=`")?;
        Ok(Def { name, slot: Slot::NONE, value: self.expression()? })
    }

    pub(super) fn param(&mut self, out: &mut Vec<Statement>) -> Parsed<()> {
        self.next();
        loop {
            let name = self.ident("the parameter's name")?;
            let default = match self.eat(TokenKind::Equals) {
                Some(_) => Some(self.expression()?),
                None => None,
            };
            out.push(Statement::Param { name, slot: Slot::NONE, default });
            if self.eat(TokenKind::Comma).is_none() {
                return Ok(());
            }
        }
    }

    pub(super) fn process(&mut self) -> Parsed<Statement> {
        self.next();
        let name = self.ident("the layer's name")?;
        let parent_name = match self.eat(TokenKind::Colon) {
            Some(_) => Some(self.ident("the parent layer's name")?),
            None => None,
        };
        self.expect(TokenKind::Equals, "`=`")?;
        let (entries, _) = self.def_list()?;
        self.program.layers.push(LayerDefinition { name, parent_name, parent: None, entries, constant: false });
        Ok(Statement::Process(self.program.layers.len() - 1))
    }

    pub(super) fn subnet(&mut self) -> Parsed<Statement> {
        self.next();
        let name = self.ident("the subnet's name")?;
        let (nodes, _) = self.name_list()?;
        let open = self.expect(TokenKind::OpenList, "`[` of the parameter list")?;
        let mut formals = Vec::new();
        while self.eat(TokenKind::CloseList).is_none() {
            let name = self.list_name(open)?;
            self.expect(TokenKind::Equals, "`=` and a default, `*` (must be given) or `?` (may stay open)")?;
            let mark = self.peek();
            let default = match mark.kind {
                TokenKind::Star => None,
                TokenKind::Question => Some(Expr { kind: ExprKind::Undefined, span: mark.span }),
                _ => Some(self.expression()?),
            };
            if matches!(mark.kind, TokenKind::Star | TokenKind::Question) {
                self.next();
            }
            formals.push(Formal { name, slot: Slot::NONE, default });
            self.short(formals.len(), open)?;
        }
        self.twice(formals.iter().map(|formal| &formal.name), "parameter", "last");
        // indices may distinguish nodes with the same base name
        self.twice(nodes.iter().filter(|n| n.indices.is_empty()).map(|n| &n.base), "node", "last");
        let body = self.block()?;
        self.program.subnets.push(SubnetDefinition { name, nodes, formals, body, variables: 0 });
        Ok(Statement::Subnet(self.program.subnets.len() - 1))
    }

    fn element(&mut self) -> Parsed<ElementStatement> {
        let first = self.ident("a statement")?;
        let mut name = None;
        let mut words = vec![first.clone()];
        if self.peek().kind == TokenKind::Open {
            name = Some(self.indices(first)?);
            words.clear();
        }
        while words.len() < 3 {
            match self.peek().kind {
                TokenKind::Identifier => words.push(self.ident("a name")?),
                TokenKind::Star => {
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
        let (Ok([model, layer_name]), TokenKind::OpenList) = (<[Ident; 2]>::try_from(words), self.peek().kind) else {
            let help = "an element is `[NAME] MODEL LAYER [nodes] [parameters]`, with `*` for no layer";
            let span = self.peek().span;
            let found = self.peek().kind.called();
            return Err(self.sink.error(
                "E015",
                span,
                format!("expected an element's model and layer, found {found}"),
                help,
            ));
        };
        let (mut number, mut unnamed) = (0, Arc::default());
        if name.is_none() {
            self.anonymous += 1;
            number = self.anonymous;
            unnamed = Arc::from(format!("anon{number}"));
        }
        let (nodes, nodes_span) = self.name_list()?;
        let (parameters, _) = self.def_list()?;
        let (layer, subnet) = (LayerRef::None, None);
        let turns = |name: &str| matches!(name, "ox" | "oy" | "oz");
        let given = || parameters.iter().map(|def| &*def.name.name).filter(|name| !turns(name));
        let built_in = elements::model(&model.name).map(|model| (model, given().all(|name| model.takes(name))));
        Ok(ElementStatement {
            name,
            number,
            unnamed,
            model,
            subnet,
            built_in,
            layer_name,
            layer,
            nodes,
            nodes_span,
            parameters,
        })
    }

    // ---- lists ----

    fn indices(&mut self, base: Ident) -> Parsed<Name> {
        if self.peek().kind != TokenKind::Open {
            return Ok(Name { span: base.span, base, indices: Vec::new() });
        }
        let open = self.next();
        let (indices, close) = self.outermost(|p| p.arguments(open))?;
        if indices.is_empty() {
            return Err(self.sink.error("E016", close, "an index is missing".into(), "write a whole number"));
        }
        Ok(Name { span: base.span.to(close), base, indices })
    }

    fn name_list(&mut self) -> Parsed<(Vec<Name>, TextSpan)> {
        let open = self.expect(TokenKind::OpenList, "`[` of the node list")?;
        let mut names = Vec::new();
        loop {
            match self.peek().kind {
                TokenKind::CloseList => {
                    let close = self.next();
                    return Ok((names, open.span.to(close.span)));
                }
                TokenKind::Comma => {
                    let comma = self.next();
                    self.sink.error(
                        "E017",
                        comma.span,
                        "node names are separated by blanks".into(),
                        "remove the comma",
                    );
                }
                TokenKind::End => return Err(self.unclosed(open)),
                _ if self.statement_ahead() => return Err(self.unclosed(open)),
                _ => {
                    let base = self.ident("a node name or `]`")?;
                    names.push(self.indices(base)?);
                }
            }
        }
    }

    fn def_list(&mut self) -> Parsed<(Vec<Def>, TextSpan)> {
        let open = self.expect(TokenKind::OpenList, "`[` of the parameter list")?;
        let mut defs = Vec::new();
        loop {
            match self.peek().kind {
                TokenKind::CloseList => {
                    let close = self.next();
                    self.twice(defs.iter().map(|def: &Def| &def.name), "parameter", "first");
                    return Ok((defs, open.span.to(close.span)));
                }
                TokenKind::Comma => {
                    let comma = self.next();
                    self.sink.error(
                        "E017",
                        comma.span,
                        "parameters are separated by blanks".into(),
                        "remove the comma",
                    );
                }
                _ => {
                    let name = self.list_name(open)?;
                    self.expect(TokenKind::Equals, &format!("`=` after the parameter `{}`", name.name))?;
                    defs.push(Def { name, slot: Slot::NONE, value: self.expression()? });
                    self.short(defs.len(), open)?;
                }
            }
        }
    }

    /// Rejects overlong parameter lists, since elements search the list for each name.
    fn short(&mut self, length: usize, open: Lexeme) -> Parsed<()> {
        if length <= MAX_PARAMETERS {
            return Ok(());
        }
        let message = format!("a list of more than {MAX_PARAMETERS} parameters");
        Err(self.sink.error("E018", open.span, message, "split the element, or name what it takes"))
    }

    /// The next name of a parameter list, or the error that the list was left open.
    fn list_name(&mut self, open: Lexeme) -> Parsed<Ident> {
        if self.peek().kind == TokenKind::End || self.statement_ahead() {
            return Err(self.unclosed(open));
        }
        self.ident("a parameter name or `]`")
    }
}
