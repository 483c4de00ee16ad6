"""Highlighting of SUGAR netlists (`netlist`) and of SPICE decks (`deck`)."""

from pygments.lexer import RegexLexer, bygroups, words
from pygments.token import Comment, Keyword, Name, Number, Operator, Punctuation, String, Text, Whitespace

NUMBER = r"(?<![\w.])\d+(?:\.\d*)?(?:[eE][-+]?\d+)?[a-zA-Z]*"


class NetlistLexer(RegexLexer):
    """SUGAR 2: comments by %, statements, layers in brackets."""

    name, aliases, filenames = "SUGAR netlist", ["netlist"], ["*.net"]
    tokens = {
        "root": [
            (r"%.*$", Comment.Single),
            (r"'[^'\n]*'|\"[^\"\n]*\"", String),
            (words(("subnet", "param", "process", "for", "if", "else", "call", "uses"), suffix=r"\b"), Keyword),
            (r"([A-Za-z_]\w*)(\s*)(=)(?!=)", bygroups(Name.Attribute, Whitespace, Operator)),
            (NUMBER, Number),
            (r"[A-Za-z_][\w.]*", Name),
            (r"[][(),:;]", Punctuation),
            (r"[-+*/^=<>~!&|]", Operator),
            (r"\s+", Whitespace),
            (r".", Text),
        ]
    }


class DeckLexer(RegexLexer):
    """SPICE: a title, comments by *, lines with a dot, devices."""

    name, aliases, filenames = "SPICE deck", ["deck", "spice"], ["*.cir", "*.lib"]
    tokens = {
        "root": [
            (r"^\s*\*.*$", Comment.Single),
            (r"^\s*\.\w+", Keyword),
            (r"^\s*[A-Za-z]\w*", Name.Function),
            (r"\"[^\"\n]*\"", String),
            (r"[A-Za-z_]\w*(?=\s*=)", Name.Attribute),
            (r"%\w+", Keyword.Type),
            (NUMBER, Number),
            (r"[A-Za-z_@][\w.@]*", Name),
            (r"[][(),{}=:]", Punctuation),
            (r"\s+", Whitespace),
            (r".", Text),
        ]
    }


def setup(app):
    app.add_lexer("netlist", NetlistLexer)
    app.add_lexer("deck", DeckLexer)
    return {"parallel_read_safe": True}
