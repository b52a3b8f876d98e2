"""Queries on the syntax tree of a module: scopes, names, imports, constants."""

import ast
import re
from typing import Iterable, Iterator, List, Set

_SCOPES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)
_LEAVES = (ast.Return, ast.Raise, ast.Break, ast.Continue)
_FOR_CHECKERS = re.compile(rb"^if MYPY:\n(?:(?:[ \t]+.*)?\n)+?(?=\S|\Z)", re.MULTILINE)
_NOT_COMPILED = re.compile(rb"^[ \t]+|  # .*", re.MULTILINE)
_TYPE_COMMENT = re.compile(
    rb"(?:^[ \t]+# type: (?!ignore).*\n|  # type: (?!ignore).*)", re.MULTILINE
)


def first_statement(body: List[ast.stmt]) -> int:
    """Return the index of a body's first statement after docstring and future imports."""
    at = int(ast.get_docstring(ast.Module(body=body), clean=False) is not None)
    while at < len(body) and getattr(body[at], "module", "") == "__future__":
        at += 1
    return at


def walk_scope(body: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Yield all nodes of statements, except those inside of other functions and classes."""
    left = list(body)
    while left:
        node = left.pop()
        yield node
        if not isinstance(node, _SCOPES):
            left.extend(ast.iter_child_nodes(node))


def as_run(tree: ast.Module) -> ast.Module:
    """Remove the bodies of `if MYPY:`, which never run, from a module's tree; return it."""
    for node in tree.body:
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "MYPY":
            node.body = [ast.copy_location(ast.Pass(), node.body[0])]
    return tree


def as_loaded(source: bytes) -> bytes:
    """Return a module's source (bytes) as far as it is in what is compiled.

    What stands under `if MYPY:` is not run, but compiled, and so it is loaded.  Indents and
    comments are not in what is compiled.
    """
    bare = _FOR_CHECKERS.sub(lambda block: _NOT_COMPILED.sub(b"", block.group()), source)
    return _TYPE_COMMENT.sub(b"", bare)


def may_leave(statement: ast.stmt) -> bool:
    """Return True if the statement may leave its block early."""
    return not isinstance(statement, _SCOPES + _LEAVES) and any(
        isinstance(node, _LEAVES) for node in walk_scope([statement])
    )


def stored_names(node: ast.AST) -> Set[str]:
    """Return the names in an expression."""
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}


def assigned_names(body: Iterable[ast.AST]) -> Set[str]:
    """Return the names that these statements bind."""
    names = set()
    for node in walk_scope(body):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            names.add(node.name)
        elif isinstance(node, ast.ExceptHandler):
            names.update([node.name] if node.name else [])
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            names |= {(alias.asname or alias.name).partition(".")[0] for alias in node.names}
    return names


def imported_modules(body: Iterable[ast.AST]) -> Set[str]:
    """Return the names of the modules that statements import, and of their packages."""
    names = set()
    for node in walk_scope(body):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {node.module} | {node.module + "." + alias.name for alias in node.names}
    return names | {name.partition(".")[0] for name in names}


def parameter_names(args: ast.arguments) -> Set[str]:
    """Return the names of a function's parameters."""
    named = [*getattr(args, "posonlyargs", ()), *args.args, *args.kwonlyargs]
    named += [a for a in (args.vararg, args.kwarg) if a]
    return {a.arg for a in named}


def default_values(args: ast.arguments) -> List[ast.expr]:
    """Return the expressions of the defaults of a function's parameters."""
    return args.defaults + [value for value in args.kw_defaults if value]


_LITERALS = ("Constant", "Num", "Str", "Bytes", "NameConstant")  # all but the first: Python 3.7


def literal_value(node: ast.AST) -> object:
    """Return the value of a literal constant; None for any other node."""
    if type(node).__name__ not in _LITERALS:
        return None
    return next(getattr(node, field) for field in ("value", "n", "s") if hasattr(node, field))


def any_whole_number(*nodes: ast.AST) -> bool:
    """Return True if one of them is a literal integer."""
    return any(type(literal_value(node)) is int for node in nodes)
