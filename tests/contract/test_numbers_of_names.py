"""Numbers of names are read by `flagdata.core.numbered`, and no parsed number is a length. The test
reads the source.

A name of a file may state any number. `int` of a part of a name is an offence outside
`flagdata.core.numbered`, and so is a `range`, an array or a list as long as a number that the same
function read from a text by `int`.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from tests.contract.imports import ROOT, modules, tree

PRODUCT = ("flagdata", "sim", "models", "measure")
READER = "flagdata/core/numbered.py"
BOUNDED = {
    "flagdata/timebase.py": "hours and minutes of two digits, by the pattern of a zone",
    "flagdata/core/scheduling.py": "threads of this process, as the kernel numbers them",
    "flagdata/ingest/camera/name_clocks.py": "hours, minutes, seconds and nanoseconds, by the "
    "pattern of a clock",
}
"""Modules that read numbers of names by `int`, with what bounds these."""
NAMES = {"name", "names", "stem", "stems", "digits"}
"""Variables that hold names, or parts of them."""
OF_PATHS = {"name", "stem", "suffix", "parts"}
OF_TEXTS = {
    *(
        "fullmatch",
        "match",
        "search",
        "finditer",
        "findall",
        "group",
        "groups",
        "split",
        "rsplit",
        "partition",
    ),
    *(
        "rpartition",
        "removeprefix",
        "removesuffix",
        "strip",
        "lstrip",
        "rstrip",
        "ljust",
        "rjust",
        "lower",
        "casefold",
    ),
}
"""Methods that give parts of a text."""
KEEPING = {
    "zip",
    "sorted",
    "list",
    "tuple",
    "map",
    "enumerate",
    "filter",
    "reversed",
    "next",
    "iter",
    "str",
    "set",
}
LENGTHS = {"range", "arange", "zeros", "ones", "empty", "full", "linspace", "bytes", "bytearray"}


@dataclass(frozen=True)
class Parts:
    """What a function has of a text: the expressions that hold a part of one, as far as its own
    statements say.

    Attributes:
        variables: names of the variables that do.
        attributes: those of any value that are a text.
        of_any: whether a part of any text counts, and not of a name alone.
    """

    variables: frozenset[str]
    attributes: frozenset[str]
    of_any: bool

    def hold(self, node: ast.AST) -> bool:
        match node:
            case ast.Name(id=name):
                return name in self.variables
            case ast.Attribute(attr=attribute):
                return attribute in self.attributes
            case ast.Call(func=ast.Attribute(value=value, attr=method), args=arguments) if (
                method in OF_TEXTS
            ):
                return self.of_any or any(map(self.hold, (value, *arguments)))
            case ast.Call(func=ast.Name(id=function), args=arguments):
                return function in KEEPING and any(map(self.hold, arguments))
            case ast.Subscript(value=value) | ast.NamedExpr(value=value) | ast.Starred(value=value):
                return self.hold(value)
            case ast.BoolOp(values=parts) | ast.Tuple(elts=parts) | ast.List(elts=parts):
                return any(map(self.hold, parts))
            case ast.IfExp(body=body, orelse=other):
                return self.hold(body) or self.hold(other)
            case ast.BinOp(left=left, right=right):
                return self.hold(left) or self.hold(right)
            case (
                ast.ListComp(elt=element) | ast.GeneratorExp(elt=element) | ast.SetComp(elt=element)
            ):
                return self.hold(element)
        return False

    def within(self, function: ast.AST) -> Parts:
        """These parts, with the variables of a function to which one is given."""
        known = self
        while True:
            more = {
                variable.id
                for target, value in _given(function)
                if known.hold(value)
                for variable in ast.walk(target)
                if isinstance(variable, ast.Name)
            }
            if more <= known.variables:
                return known
            known = Parts(known.variables | more, self.attributes, self.of_any)


def _given(function: ast.AST) -> Iterator[tuple[ast.expr, ast.expr]]:
    for node in ast.walk(function):
        if isinstance(node, ast.Assign):
            yield from (
                (target, node.value)
                for target in node.targets
                if isinstance(target, ast.Name | ast.Tuple)
            )
        elif isinstance(node, ast.NamedExpr):
            yield node.target, node.value
        elif isinstance(node, ast.For | ast.comprehension):
            yield node.target, node.iter


OF_NAMES = Parts(frozenset(NAMES), frozenset(OF_PATHS), of_any=False)
OF_ANY = Parts(frozenset(), frozenset(OF_PATHS), of_any=True)


def readings(function: ast.AST, parts: Parts) -> Iterator[ast.Call]:
    """Calls of `int`, or `map` with it, on parts of a text."""
    known = parts.within(function)
    for node in ast.walk(function):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.args:
            mapped = (
                node.func.id == "map"
                and isinstance(node.args[0], ast.Name)
                and node.args[0].id == "int"
            )
            if (mapped or node.func.id == "int") and any(map(known.hold, node.args)):
                yield node


def functions(source: ast.Module) -> Iterator[ast.AST]:
    return (
        node
        for node in ast.walk(source)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    )


def read_from_names(source: ast.Module) -> set[int]:
    """Lines on which `int` reads a part of a name."""
    return {call.lineno for function in functions(source) for call in readings(function, OF_NAMES)}


def counted_up_to(source: ast.Module) -> set[int]:
    """Lines on which a function counts up to a number that it read by `int` from a text, or makes
    something so long."""
    lines = set()
    for function in functions(source):
        calls = list(readings(function, OF_ANY))
        read = {id(call) for call in calls}
        parsed = {
            name.id
            for target, value in _given(function)
            if any(id(node) in read for node in ast.walk(value))
            for name in ast.walk(target)
            if isinstance(name, ast.Name)
        }
        for node in ast.walk(function):
            if isinstance(node, ast.Call):
                called = (
                    node.func.attr
                    if isinstance(node.func, ast.Attribute)
                    else getattr(node.func, "id", "")
                )
                lengths = node.args if called in LENGTHS else []
            elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
                sides = (node.left, node.right)
                lengths = (
                    sides if any(isinstance(side, ast.List | ast.Tuple) for side in sides) else []
                )
            else:
                continue
            inner = [part for length in lengths for part in ast.walk(length)]
            if any(
                id(part) in read or (isinstance(part, ast.Name) and part.id in parsed)
                for part in inner
            ):
                lines.add(node.lineno)
    return lines


def test_numbers_of_names_are_read_by_one_module() -> None:
    found = {str(path.relative_to(ROOT)): read_from_names(tree(path)) for path in modules(*PRODUCT)}
    assert {
        module: lines
        for module, lines in found.items()
        if lines and module not in {READER, *BOUNDED}
    } == {}
    assert {module for module in BOUNDED if not found[module]} == set(), (
        "bounded no more: take it off the list"
    )


def test_nothing_is_as_long_as_a_number_that_a_text_states() -> None:
    found = {str(path.relative_to(ROOT)): counted_up_to(tree(path)) for path in modules(*PRODUCT)}
    assert {module: lines for module, lines in found.items() if lines} == {}


@pytest.mark.parametrize(
    "body",
    [
        "return int(path.stem)",
        "return [int(m[1]) for entry in folder if (m := FRAME.fullmatch(entry.name))]",
        "parts = DIGITS.split(path.name); return max(map(int, parts[1::2]))",
        "first, last = (int(number) for number in name.split('-'))",
    ],
)
def test_a_number_of_a_name_is_found(body: str) -> None:
    assert read_from_names(ast.parse(f"def f(): {body}"))


@pytest.mark.parametrize(
    "body",
    [
        "return range(int(text.split()[0]))",
        "number = int(match.group(1)); return np.zeros((number, 3))",
        "last = int(LINE.search(text)[1]) + 1; return [0] * last",
    ],
)
def test_a_length_that_a_text_states_is_found(body: str) -> None:
    assert counted_up_to(ast.parse(f"def f(): {body}"))


def test_other_numbers_are_no_such_lengths() -> None:
    for body in (
        "return range(len(text.split()))",
        "return int(values.max()) + int(times[0])",
        "return [0] * n",
    ):
        source = ast.parse(f"def f(): {body}")
        assert not read_from_names(source)
        assert not counted_up_to(source)
