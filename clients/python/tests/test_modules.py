"""Modules of the package import each other in no circles, and at their heads alone: code that two of them need belongs to a third."""

from __future__ import annotations

import ast
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "src" / "bimorph"


def _own(tree: ast.AST) -> set[str]:
    """Modules of the package that are imported below a node, but for the types of checkers."""
    found: set[str] = set()
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            continue
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            found |= {alias.name for alias in node.names} if node.module is None else {node.module.split(".")[0]}
        found |= _own(node)
    return found


def _modules() -> dict[str, ast.Module]:
    return {path.stem: ast.parse(path.read_text("utf-8")) for path in PACKAGE.glob("*.py") if path.stem != "__init__"}


def test_functions_import_no_module_of_the_package() -> None:
    """An import inside a function hides a circle."""
    functions = (ast.FunctionDef, ast.AsyncFunctionDef)
    modules = _modules()
    assert len(modules) > 50
    hidden = {
        f"{name}.{node.name}": sorted(_own(node) & set(modules))
        for name, tree in modules.items()
        for node in ast.walk(tree)
        if isinstance(node, functions) and _own(node) & set(modules)
    }
    assert not hidden, hidden


def test_modules_import_each_other_in_no_circles() -> None:
    """What is left when modules that import no other one that is left are taken away, again and again."""
    left = {name: _own(tree) for name, tree in _modules().items()}
    while free := [name for name, imported in left.items() if not imported & (set(left) - {name})]:
        for name in free:
            del left[name]
    assert not left, {name: sorted(imported & set(left)) for name, imported in left.items()}
