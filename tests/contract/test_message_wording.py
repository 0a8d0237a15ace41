"""No control flow on the wording of the program's own messages: errors and findings have a stable
kind for that."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from flagdata import errors
from tests.contract.imports import ROOT, modules, tree

PRODUCT = ("flagdata", "sim", "models", "measure")
OWN = {name for name in dir(errors) if name.endswith("Error")} | {"Exception", "BaseException"}
"""Exceptions with messages of this project. Those of other libraries alone may have nothing but
their message."""
WORDING = {"what", "fix", "sentence"}
"""Attributes of errors, findings and reasons that hold sentences."""
SEARCHES = {"startswith", "endswith", "find", "index", "count", "match", "search", "fullmatch"}


def caught(source: ast.Module) -> set[str]:
    """Names under which a module catches exceptions that may be the project's own."""
    names: set[str] = set()
    for handler in ast.walk(source):
        if (
            isinstance(handler, ast.ExceptHandler)
            and handler.name is not None
            and handler.type is not None
        ):
            types = {node.id for node in ast.walk(handler.type) if isinstance(node, ast.Name)}
            if types & OWN:
                names.add(handler.name)
    return names


def is_wording(node: ast.AST, names: set[str]) -> bool:
    """Whether an expression is the text of an error, or a sentence of an error, finding or
    reason."""
    if isinstance(node, ast.Call):
        if isinstance(node.func, ast.Attribute) and node.func.attr in {
            "lower",
            "casefold",
            "strip",
        }:
            return is_wording(node.func.value, names)
        of_error = any(
            isinstance(argument, ast.Name) and argument.id in names for argument in node.args
        )
        return isinstance(node.func, ast.Name) and node.func.id in {"str", "repr"} and of_error
    if isinstance(node, ast.Subscript):
        return is_wording(node.value, names)
    if not isinstance(node, ast.Attribute):
        return False
    return node.attr in WORDING or (
        node.attr == "args" and isinstance(node.value, ast.Name) and node.value.id in names
    )


def decisions(source: ast.Module) -> Iterator[int]:
    """Lines on which the wording of a message is compared or searched."""
    names = caught(source)
    for node in ast.walk(source):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            empty = any(
                isinstance(side, ast.Constant) and side.value in ("", None) for side in sides
            )
            if not empty and any(is_wording(side, names) for side in sides):
                yield node.lineno
        elif (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr in SEARCHES
        ):
            searched = [node.func.value, *node.args]
            yield from [node.lineno] * any(is_wording(part, names) for part in searched)


def test_the_product_decides_nothing_by_the_wording_of_a_message() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in modules(*PRODUCT)
        for line in decisions(tree(path))
    ]
    assert found == []


def test_searches_of_own_messages_are_found_and_those_of_a_library_are_not() -> None:
    handler = "try:\n    f()\nexcept {} as error:\n    if {}:\n        raise\n"
    own = [
        "'zone' in error.what",
        "str(error) == 'x'",
        "error.args[0].startswith('x')",
        "re.search('x', str(error))",
    ]
    assert [
        test for test in own if not list(decisions(ast.parse(handler.format("InputError", test))))
    ] == []
    assert not list(
        decisions(ast.parse(handler.format("InputError", "error.kind == 'zone-missing'")))
    )
    assert not list(
        decisions(ast.parse(handler.format("DeltaError", "'(os error ' in str(error)")))
    )
