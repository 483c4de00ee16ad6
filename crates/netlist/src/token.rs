//! The words of a netlist.

use super::source::TextSpan;

/// Kind of a token. Identifiers and strings keep only their span: their text is in the source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum TokenKind {
    Identifier,
    Number(f64),
    Text,
    /// `uses FILE`, one token; the file's name is the last word of its span.
    Uses,
    Subnet,
    Param,
    Process,
    For,
    If,
    Else,
    Call,
    Plus,
    Minus,
    Star,
    Slash,
    Caret,
    Open,
    Close,
    OpenList,
    CloseList,
    Equals,
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    And,
    Or,
    Not,
    Colon,
    Comma,
    Question,
    End,
}

/// A word with its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lexeme {
    pub(crate) kind: TokenKind,
    pub(crate) span: TextSpan,
    /// True for the first token of a line, where parsing can continue after an error.
    pub(crate) starts_line: bool,
}

impl TokenKind {
    /// How messages call it.
    pub(crate) fn called(self) -> &'static str {
        match self {
            Self::Identifier => "a name",
            Self::Number(_) => "a number",
            Self::Text => "a string",
            Self::Uses => "`uses`",
            Self::Subnet => "`subnet`",
            Self::Param => "`param`",
            Self::Process => "`process`",
            Self::For => "`for`",
            Self::If => "`if`",
            Self::Else => "`else`",
            Self::Call => "`call`",
            Self::Plus => "`+`",
            Self::Minus => "`-`",
            Self::Star => "`*`",
            Self::Slash => "`/`",
            Self::Caret => "`^`",
            Self::Open => "`(`",
            Self::Close => "`)`",
            Self::OpenList => "`[`",
            Self::CloseList => "`]`",
            Self::Equals => "`=`",
            Self::Equal => "`==`",
            Self::NotEqual => "`!=`",
            Self::Less => "`<`",
            Self::LessEqual => "`<=`",
            Self::Greater => "`>`",
            Self::GreaterEqual => "`>=`",
            Self::And => "`&`",
            Self::Or => "`|`",
            Self::Not => "`!`",
            Self::Colon => "`:`",
            Self::Comma => "`,`",
            Self::Question => "`?`",
            Self::End => "the end of the file",
        }
    }

    /// True for a word that can only begin a statement.
    pub(crate) fn begins_statement(self) -> bool {
        matches!(self, Self::Uses | Self::Subnet | Self::Param | Self::Process | Self::For | Self::If | Self::Call)
    }
}
