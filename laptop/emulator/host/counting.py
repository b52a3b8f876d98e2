"""Instrumentation by which a program counts its own instructions.

The emulated brick is far slower than the laptop, which matters to a control loop.
So the time of a program is modelled, not measured:

    t = CPI / f * sum over basic blocks b of n_b * c_b

with n_b the executions of a block, c_b its cost in instructions of the brick's processor, CPI the
cycles per instruction and f the clock rate (processor.py). This is static source-level timing by
basic blocks, as in Li and Malik, Performance analysis of embedded software using implicit path
enumeration, DAC 1995; except that here the program itself counts n_b as it runs.

The syntax tree is rewritten: each basic block begins with `_count_ += cost`.
So the count depends on the program alone, and a run is reproducible. Host
time scaled by a factor would vary with the load; sys.settrace would cost a call for each line.

Calls into C cost what `instruction_costs` says by name; an unknown one costs a plain call. Of
expressions that are evaluated conditionally (`a and b`, `a if b else c`) the later parts cost half.
"""

import ast
import builtins
import contextlib
import sys
from types import CodeType
from typing import Iterator, List, Optional, Sequence, Set, Union

from laptop.emulator.host.instruction_costs import CALLS, COSTS, METHODS, imports
from laptop.emulator.host.syntax_tree import (
    any_whole_number,
    as_loaded,
    as_run,
    assigned_names,
    default_values,
    first_statement,
    imported_modules,
    literal_value,
    may_leave,
    parameter_names,
    stored_names,
    walk_scope,
)

MYPY = False
if MYPY:
    from typing import Collection, Dict  # noqa: F401

    Comprehension = Union[ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp]

COUNT, SPEND, LOAD, ENROL = "_count_", "_spend_", "_load_", "_enrol_"
"""Names in an instrumented module: of its count; of the function that adds to it where no statement
can stand; of the function that charges a function's imports; and of the builtin that each module
calls first with its names, the length of its source (as it is loaded) and its imports, see
processor.Processor.enrol."""

DUE, LOOK = "_due_", "_look_"
"""Names of a threshold, and of the function that each turn of a `while` calls once the count is
beyond it: in a long loop other threads run, and signals are handled."""

EV3DEV2 = "ev3dev2"

NAMED_TUPLES = ("collections.namedtuple", "shared.record.record")
"""Functions that make classes of tuples whose elements have names."""

_WALRUS = sys.version_info >= (3, 8)


def compiled(source: bytes, file: str) -> CodeType:
    """Compile a module's `source` (bytes) with its counts."""
    tree = _Counting().module(as_run(ast.parse(source, file)), len(as_loaded(source)))
    return compile(tree, file, "exec", dont_inherit=True)


class _Counting(object):
    """Rewriter that inserts the counts into one module."""

    def __init__(self) -> None:
        self._globals = set()  # type: Set[str]
        self._imports = {}  # type: Dict[str, str]
        # Names of the module -> what was called to make them.
        self._made = {}  # type: Dict[Optional[str], str]
        self._scopes = []  # type: List[Collection[str]]
        self._walrus_allowed = True  # whether an assignment expression may stand there

    def module(self, tree: ast.Module, length: int) -> ast.Module:
        """Insert the counts into the tree of a module; `length` is that of its source, bytes."""
        self._globals = assigned_names(tree.body) | {COUNT, SPEND, LOAD, DUE, LOOK}
        body = self._block(tree.body)
        at = first_statement(body)
        asked = _asked(tree.body)
        body.insert(at, _statement("{}(globals(), {}, {})".format(ENROL, length, asked)))
        tree.body = body
        return ast.fix_missing_locations(tree)

    # Statements: the cost of the part that is always executed; other parts count themselves.

    def _block(self, body: List[ast.stmt], cost: int = 0) -> List[ast.stmt]:
        """Return statements with their counts; `cost` is that of entering them, instructions."""
        out, at = [], first_statement(body)
        out.extend(body[:at])
        for statement in body[at:]:
            cost += self._statement(statement)
            if self._scopes and isinstance(statement, (ast.Import, ast.ImportFrom)):
                out.append(_statement("{}({})".format(LOAD, _asked([statement]))))
            out.append(statement)
            if may_leave(statement):
                self._count(out, at, cost)
                at, cost = len(out), 0
        self._count(out, at, cost)
        return out

    @staticmethod
    def _count(out: List[ast.stmt], at: int, cost: int) -> None:
        if cost:
            out.insert(at, _more(cost))

    def _statement(self, node: ast.stmt) -> int:
        return getattr(self, "_" + type(node).__name__.lower(), self._other)(node)

    def _other(self, node: ast.AST) -> int:
        """Return the cost of the expressions of a node without a rule of its own."""
        return sum(self._cost(child) for child in ast.iter_child_nodes(node))

    def _functiondef(self, node: ast.FunctionDef) -> int:
        outside = sum(map(self._cost, node.decorator_list + default_values(node.args)))
        outside += COSTS["def"] + COSTS["call"] * len(node.decorator_list)
        managed = any("contextmanager" in ast.dump(decorator) for decorator in node.decorator_list)
        self._inner(node, parameter_names(node.args) | assigned_names(node.body), managed)
        return outside + self._store(ast.Name(node.name, ast.Store()))

    _asyncfunctiondef = _functiondef

    def _inner(self, node: ast.FunctionDef, names: Set[str], managed: bool) -> None:
        head = COSTS["function"] + COSTS["context manager"] * managed
        declared = {
            name for s in walk_scope(node.body) if isinstance(s, ast.Global) for name in s.names
        }
        with self._within(names - declared, True):
            node.body = self._block(node.body, head)
        node.body.insert(first_statement(node.body), ast.Global([COUNT]))

    def _classdef(self, node: ast.ClassDef) -> int:
        outside = sum(map(self._cost, node.decorator_list + node.bases)) + COSTS["class"]
        with self._within((), False):
            node.body = self._block(node.body)
        node.body.insert(first_statement(node.body), ast.Global([COUNT]))
        return outside

    def _if(self, node: ast.If) -> int:
        cost = self._test(node.test)
        node.body = self._block(node.body)
        node.orelse = self._block(node.orelse) if node.orelse else []
        return cost

    def _for(self, node: ast.For) -> int:
        turn = COSTS["turn"] + self._store(node.target)
        cost = COSTS["loop"] + self._cost(node.iter)
        node.body = self._block(node.body, turn)
        node.orelse = self._block(node.orelse) if node.orelse else []
        return cost

    def _while(self, node: ast.While) -> int:
        test = self._test(node.test) + COSTS["branch"]
        node.body = self._block(node.body, test)
        check = _statement("if {} > {}: {}()".format(COUNT, DUE, LOOK))
        for part in ast.walk(check):
            ast.copy_location(part, node)  # who asks where the program is finds the loop
        node.body.insert(0, check)
        node.orelse = self._block(node.orelse) if node.orelse else []
        return test + COSTS["branch"]

    def _try(self, node: ast.Try) -> int:
        node.body = self._block(node.body)
        for handler in node.handlers:
            kind = self._cost(handler.type) if handler.type else 0
            handler.body = self._block(handler.body, COSTS["handler"] + kind)
        node.orelse = self._block(node.orelse) if node.orelse else []
        node.finalbody = self._block(node.finalbody) if node.finalbody else []
        return COSTS["try"]

    def _with(self, node: ast.With) -> int:
        cost = 0
        for item in node.items:
            cost += COSTS["with"] + self._cost(item.context_expr)
            cost += self._store(item.optional_vars) if item.optional_vars else COSTS["pop"]
        node.body = self._block(node.body)
        return cost

    def _assign(self, node: ast.Assign) -> int:
        if not self._scopes and isinstance(node.value, ast.Call):
            made = self._name_of(node.value.func)
            for target in node.targets:
                if made and isinstance(target, ast.Name):
                    self._made[target.id] = made
        return self._cost(node.value) + sum(map(self._store, node.targets))

    def _augassign(self, node: ast.AugAssign) -> int:
        work = self._operation(node.op) + self._cost(node.value)
        return work + self._cost(node.target) + self._store(node.target)

    def _expr(self, node: ast.Expr) -> int:
        return self._cost(node.value) + COSTS["pop"]

    def _return(self, node: ast.Return) -> int:
        return COSTS["return"] + (self._cost(node.value) if node.value else 0)

    def _raise(self, node: ast.Raise) -> int:
        return COSTS["raise"] + self._other(node)

    def _import(self, node: ast.Import) -> int:
        for alias in node.names:
            self._imports[alias.asname or alias.name] = alias.name
        return COSTS["import"] * len(node.names)

    def _importfrom(self, node: ast.ImportFrom) -> int:
        for alias in node.names:
            self._imports[alias.asname or alias.name] = "{}.{}".format(node.module, alias.name)
        return COSTS["import"] + 300 * len(node.names)

    def _global(self, node: ast.stmt) -> int:
        return 0

    _nonlocal = _pass = _break = _continue = _global

    def _store(self, target: ast.expr) -> int:
        if isinstance(target, ast.Name):
            return COSTS["store" if self._is_local(target.id) else "store global"]
        if isinstance(target, ast.Attribute):
            return COSTS["store attribute"] + self._cost(target.value)
        if isinstance(target, ast.Subscript):
            return COSTS["store item"] + self._cost(target.value) + self._cost(target.slice)
        if isinstance(target, ast.Starred):
            return COSTS["list"] + self._store(target.value)
        assert isinstance(target, (ast.Tuple, ast.List))  # there is nothing else to store into
        return COSTS["unpack"] + sum(map(self._store, target.elts))

    # Expressions

    def _is_local(self, name: str) -> bool:
        return bool(self._scopes) and name in self._scopes[-1]

    def _cost(self, node: ast.AST) -> int:
        """Return the cost of an expression; counts are inserted where it iterates."""
        cost = getattr(self, "_of_" + type(node).__name__.lower(), None)
        return cost(node) if cost else self._other(node)

    def _of_name(self, node: ast.Name) -> int:
        if self._is_local(node.id):
            return COSTS["local"]
        if any(node.id in names for names in self._scopes):
            return COSTS["closure"]
        known = node.id in self._globals or not hasattr(builtins, node.id)
        return COSTS["global" if known else "builtin"]

    def _of_constant(self, node: ast.expr) -> int:
        return COSTS["constant"]

    _of_num = _of_str = _of_bytes = _of_nameconstant = _of_constant

    def _of_attribute(self, node: ast.Attribute) -> int:
        is_module = isinstance(node.value, ast.Name) and node.value.id in self._imports
        kind = "module attribute" if is_module else "attribute"
        return COSTS[kind] + self._cost(node.value)

    def _of_subscript(self, node: ast.Subscript) -> int:
        cost = self._cost(node.value) + self._cost(node.slice)
        return cost + (0 if isinstance(node.slice, ast.Slice) else COSTS["item"])

    def _of_slice(self, node: ast.Slice) -> int:
        return COSTS["slice"] + self._other(node)

    def _of_binop(self, node: ast.BinOp) -> int:
        cost = self._cost(node.left) + self._cost(node.right)
        text = isinstance(literal_value(node.left), (str, bytes))
        if isinstance(node.op, ast.Mod) and text:
            return cost + COSTS["format"]
        mixed = isinstance(node.op, (ast.Mult, ast.Div)) and any_whole_number(node.left, node.right)
        return cost + self._operation(node.op) + COSTS["mixed"] * mixed

    @staticmethod
    def _operation(op: ast.operator) -> int:
        kinds = {ast.Div: "divide", ast.Pow: "power", ast.Mod: "whole", ast.FloorDiv: "whole"}
        return COSTS[kinds.get(type(op), "add")]

    def _of_unaryop(self, node: ast.UnaryOp) -> int:
        if literal_value(node.operand) is not None:
            return COSTS["constant"]
        return COSTS["negate"] + self._cost(node.operand)

    def _of_compare(self, node: ast.Compare) -> int:
        cost = self._cost(node.left) + sum(map(self._cost, node.comparators))
        kinds = {ast.Is: "is", ast.IsNot: "is", ast.In: "in", ast.NotIn: "in"}
        usual = "compare"
        if any(any_whole_number(other) for other in [node.left, *node.comparators]):
            usual = "compare with zero"
        return cost + sum(COSTS[kinds.get(type(op), usual)] for op in node.ops)

    def _test(self, node: ast.expr) -> int:
        """Return the cost of evaluating a condition, and of the branch."""
        plain = not isinstance(node, (ast.Compare, ast.BoolOp))
        return self._cost(node) + COSTS["branch"] + COSTS["truth"] * plain

    def _of_boolop(self, node: ast.BoolOp) -> int:
        first, *others = map(self._test, node.values)
        return first + sum(others) // 2

    def _of_ifexp(self, node: ast.IfExp) -> int:
        return self._test(node.test) + (self._cost(node.body) + self._cost(node.orelse)) // 2

    def _of_tuple(self, node: ast.Tuple) -> int:
        return COSTS["tuple"] + self._elements(node)

    def _of_list(self, node: ast.List) -> int:
        return COSTS["list"] + self._elements(node)

    _of_set = _of_list

    def _elements(self, node: Union[ast.Tuple, ast.List]) -> int:
        return COSTS["per element"] * len(node.elts) + sum(map(self._cost, node.elts))

    def _of_dict(self, node: ast.Dict) -> int:
        parts = [key for key in node.keys if key] + node.values
        return COSTS["dict"] + COSTS["per pair"] * len(node.values) + sum(map(self._cost, parts))

    def _of_starred(self, node: ast.Starred) -> int:
        return COSTS["star"] + self._cost(node.value)

    def _of_yield(self, node: ast.Yield) -> int:
        return COSTS["yield"] + (self._cost(node.value) if node.value else COSTS["constant"])

    _of_yieldfrom = _of_yield

    def _of_lambda(self, node: ast.Lambda) -> int:
        with self._within(parameter_names(node.args), False):
            cost = self._cost(node.body) + COSTS["function"] + COSTS["return"]
        node.body = _either(cost, node.body)
        return COSTS["lambda"] + sum(map(self._cost, default_values(node.args)))

    def _of_call(self, node: ast.Call) -> int:
        cost = COSTS["call"]
        cost += sum(COSTS["argument"] + self._cost(argument) for argument in node.args)
        cost += sum(COSTS["keyword"] + self._cost(keyword.value) for keyword in node.keywords)
        name = self._name_of(node.func)
        if isinstance(node.func, ast.Attribute) and name is None:
            cost += COSTS["method"] + self._cost(node.func.value)
            return cost + METHODS.get(node.func.attr, 0)
        cost += self._cost(node.func)
        last = (name or "").rpartition(".")[2].lstrip("_")
        if name in CALLS:
            return cost + CALLS[name]
        if self._made.get(name) in NAMED_TUPLES:
            return cost + COSTS["named tuple"]
        return cost + (COSTS["create"] if last[:1].isupper() and not last.isupper() else 0)

    def _name_of(self, func: ast.expr) -> Optional[str]:
        """Return the name of what is called, as in CALLS; None for a method of an object."""
        if isinstance(func, ast.Name):
            return self._imports.get(func.id, func.id)
        if isinstance(func, ast.Attribute) and isinstance(func.value, ast.Attribute):
            owner = self._name_of(func.value)
            name = owner and "{}.{}".format(owner, func.attr)
            return name if name in CALLS else None
        if isinstance(func, ast.Attribute) and isinstance(func.value, ast.Name):
            owner = self._imports.get(func.value.id, self._made.get(func.value.id))
            name = owner and "{}.{}".format(owner, func.attr)
            return name if func.value.id in self._imports or name in CALLS else None
        return None

    def _of_listcomp(self, node: ast.ListComp) -> int:
        return self._comprehension(node, [node.elt], "list comprehension", "element")

    _of_setcomp = _of_listcomp

    def _of_dictcomp(self, node: ast.DictComp) -> int:
        return self._comprehension(node, [node.key, node.value], "list comprehension", "element")

    def _of_generatorexp(self, node: ast.GeneratorExp) -> int:
        return self._comprehension(node, [node.elt], "generator", "yielded")

    def _comprehension(
        self, node: "Comprehension", elements: List[ast.expr], kind: str, each: str
    ) -> int:
        cost = COSTS[kind] + self._iterated(node.generators[0])
        names = set().union(*(stored_names(part.target) for part in node.generators))
        with self._within(names, self._walrus_allowed):
            for number, part in enumerate(node.generators):
                turn = COSTS["turn"] + self._store(part.target)
                if number:
                    turn += COSTS["loop"] + self._iterated(part)
                turn += sum(map(self._test, part.ifs))
                if part is node.generators[-1]:
                    inside = COSTS[each] + sum(map(self._cost, elements))
                    if part.ifs:
                        part.ifs.append(_always(inside, self._walrus_allowed))
                    else:
                        turn += inside
                part.ifs.insert(0, _always(turn, self._walrus_allowed))
        return cost

    def _iterated(self, part: ast.comprehension) -> int:
        # (Python allows no assignment expression in the iterable of a comprehension.)
        walrus, self._walrus_allowed = self._walrus_allowed, False
        cost = self._cost(part.iter)
        self._walrus_allowed = walrus
        return cost

    @contextlib.contextmanager
    def _within(self, names: "Collection[str]", walrus: bool) -> Iterator[None]:
        """Open a scope with these local names, for a `with` block."""
        before, self._walrus_allowed = self._walrus_allowed, walrus
        self._scopes.append(names)
        yield
        self._scopes.pop()
        self._walrus_allowed = before


def _asked(body: Sequence[ast.stmt]) -> List[str]:
    """Return the imported modules that have a cost, and python-ev3dev2."""
    return sorted(imported_modules(body) & {EV3DEV2, *imports()})


def _statement(text: str) -> ast.stmt:
    return ast.parse(text).body[0]


def _expression(text: str) -> ast.expr:
    return ast.parse(text, mode="eval").body


def _more(cost: int) -> ast.stmt:
    return _statement("{} += {}".format(COUNT, cost))


def _always(cost: int, walrus: bool) -> ast.expr:
    """Return a condition for a comprehension that is true, and adds `cost` to the count."""
    if walrus and _WALRUS:
        return _expression("({0} := {0} + {1})".format(COUNT, cost))
    return _expression("not {}({})".format(SPEND, cost))


def _either(cost: int, body: ast.expr) -> ast.expr:
    """Return the body of a lambda, which adds `cost` to the count first."""
    node = _expression("{}({}) or 0".format(SPEND, cost))
    assert isinstance(node, ast.BoolOp)
    node.values[1] = body
    return node
