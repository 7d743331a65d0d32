"""Mutants of a module: its functions with one operator, constant or statement changed.

Operators are replaced by others of their kind: arithmetic, comparison, boolean and sign; constants,
conditions, results and statements are changed as well. Text of error messages, annotations and
docstrings are left alone, and so are assertions and `strict` of `zip`, which state what type
checkers cannot see.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from types import CodeType

ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}
COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
LEFT_ALONE = (ast.Raise, ast.Assert, ast.AnnAssign, ast.JoinedStr, ast.Import, ast.ImportFrom)
Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Mutant:
    """A function with one change.

    Parameters
    ----------
    module : str
        Path from the root of the repository.
    function : str
        Name within the module, with its class.
    operator : str
        Kind of the change.
    lines : tuple of int
        First and last line of the changed expression or statement.
    before, after : str
        Source of it.
    line : str
        First line of the source of it.
    number : int
        Place among the changes of the module.
    """

    module: str
    function: str
    operator: str
    lines: tuple[int, int]
    before: str
    after: str
    line: str
    number: int

    def __str__(self) -> str:
        return f"{self.module}:{self.lines[0]} {self.function}: {self.change}"

    @property
    def change(self) -> str:
        """Source before and after."""
        return f"{self.before} -> {self.after}"


Change = tuple[str, ast.AST, str, ast.AST]


def changes_of(function: Function) -> Iterator[Change]:
    """Yield the changes of a function: kind, node, name of its field or item, and new value."""
    body = function.body[1:] if ast.get_docstring(function) else function.body
    stack: list[tuple[ast.AST, bool]] = [(node, True) for node in reversed(body)]
    while stack:
        node, counts = stack.pop()
        if isinstance(node, LEFT_ALONE) or (isinstance(node, ast.keyword) and node.arg == "strict"):
            continue
        if counts:
            yield from changes_at(node)
        if isinstance(node, Function):  # without defaults and annotations
            children: list[ast.AST] = list(node.body)
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") in {"cast", "TypeVar"}:
            children = list(node.args[1:])
        else:
            children = list(ast.iter_child_nodes(node))
        stack += [(child, True) for child in reversed(children)]


def changes_at(node: ast.AST) -> Iterator[Change]:
    """Yield the changes of one expression or statement."""
    match node:
        case ast.BinOp(op=op) | ast.AugAssign(op=op) if type(op) in ARITHMETIC:
            texts = isinstance(op, ast.Mod) and isinstance(
                getattr(node, "left", None), ast.Constant
            )
            if not texts:
                yield "arithmetic", node, "op", ARITHMETIC[type(op)]()
        case ast.Compare(ops=[op, *rest]) if type(op) in COMPARISONS:
            changed = deepcopy(node)
            changed.ops = [COMPARISONS[type(op)](), *rest]
            yield "comparison", node, "", changed
        case ast.BoolOp(op=op):
            yield "boolean", node, "op", ast.And() if isinstance(op, ast.Or) else ast.Or()
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield "boolean", node, "", operand
        case ast.UnaryOp(op=ast.USub(), operand=operand) if not isinstance(operand, ast.Constant):
            yield "arithmetic", node, "", operand
        case ast.Constant(value=bool() as value):
            yield "constant", node, "value", ast.Constant(not value)
        case ast.Constant(value=int() as value):
            yield "constant", node, "value", ast.Constant(value + 1)
        case ast.Constant(value=float() as value):
            yield "constant", node, "value", ast.Constant(1.5 * value if value else 1.0)
        case ast.Return(value=ast.expr() as value) if not isinstance(value, ast.Constant):
            yield "result", node, "value", ast.Constant(None)
    match node:
        case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
            if not isinstance(test, ast.Constant):
                yield "condition", node, "test", ast.Constant(False)
        case ast.AugAssign() | ast.Continue() | ast.Break():
            yield "statement", node, "", ast.Pass()
        case ast.Expr(value=ast.Call()):
            yield "statement", node, "", ast.Pass()
        case ast.Assign(targets=[ast.Subscript() | ast.Attribute()]):
            yield "statement", node, "", ast.Pass()


def functions_of(tree: ast.Module) -> Iterator[tuple[str, Function]]:
    """Yield the functions and methods of a module with their names."""
    for node in tree.body:
        if isinstance(node, Function):
            yield node.name, node
        elif isinstance(node, ast.ClassDef):
            for item in node.body:
                if isinstance(item, Function):
                    yield f"{node.name}.{item.name}", item


def mutants_of(root: Path, path: Path) -> list[Mutant]:
    """Return all mutants of a module."""
    found, text = [], path.read_text(encoding="utf-8")
    sources = text.splitlines()
    for name, function in functions_of(ast.parse(text)):
        for kind, node, field, value in changes_of(function):
            lines = node.lineno, node.end_lineno or node.lineno  # type: ignore[attr-defined]
            before, after = _texts(node, field, value)
            place = path.relative_to(root).as_posix(), name, kind, lines
            line = sources[lines[0] - 1].strip()
            found.append(Mutant(*place, before, after, line, len(found)))
    return found


def _texts(node: ast.AST, field: str, value: ast.AST) -> tuple[str, str]:
    """Return the source of a node before and after a change, without the bodies of blocks."""
    changed = deepcopy(node)
    if field and isinstance(node, ast.Constant):
        changed = value
    elif field:
        setattr(changed, field, deepcopy(value))
    else:
        changed = value
    first, second = (ast.unparse(ast.fix_missing_locations(one)) for one in (node, changed))
    if isinstance(node, ast.If | ast.While):
        first, second = first.partition("\n")[0], second.partition("\n")[0]
    return first, second


def mutated_code(root: Path, mutant: Mutant) -> CodeType:
    """Return the compiled code of the changed function."""
    path = root / mutant.module
    tree = ast.parse(path.read_text(encoding="utf-8"))
    left = mutant.number
    for name, function in functions_of(tree):
        for _, node, field, value in changes_of(function):
            if left:
                left -= 1
                continue
            assert name == mutant.function
            _change(function, node, field, value)
            code = compile(ast.fix_missing_locations(tree), str(path), "exec")
            return next(_codes_of(code, name, function.lineno))
    raise AssertionError(mutant)


def _change(function: Function, node: ast.AST, field: str, value: ast.AST) -> None:
    if field and isinstance(node, ast.Constant):
        assert isinstance(value, ast.Constant)
        node.value = value.value
    elif field:
        setattr(node, field, ast.copy_location(value, node))
    else:
        Replaced(node, ast.copy_location(value, node)).visit(function)


class Replaced(ast.NodeTransformer):
    """Replacement of one node of a tree."""

    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self.new if node is self.old else self.generic_visit(node)


def _codes_of(code: CodeType, name: str, line: int) -> Iterator[CodeType]:
    """Yield the code objects within another one that have a qualified name."""
    for item in code.co_consts:
        if isinstance(item, CodeType):
            if item.co_qualname == name:
                yield item
            yield from _codes_of(item, name, line)
