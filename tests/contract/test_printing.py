"""What a terminal is given goes through `flagdata.core.console`, which escapes it. The test reads
the source."""

from __future__ import annotations

import ast

from tests.contract.imports import PACKAGES, ROOT, modules, tree

PRINTER = "flagdata/core/console.py"
ALLOWED = {
    "measure/closing/null_options.py": "bars of stages, whose names are escaped",
}
CLICK = {"echo", "secho", "echo_via_pager", "prompt", "confirm", "style"}
STREAMS = {"stdout", "stderr", "__stdout__", "__stderr__"}


def _name(node: ast.expr) -> str:
    return (
        f"{_name(node.value)}.{node.attr}"
        if isinstance(node, ast.Attribute)
        else getattr(node, "id", "")
    )


def printing(source: ast.AST) -> set[str]:
    """What of a module writes to a terminal: `print`, what click and tqdm write, and the streams
    but for `isatty`."""
    asked = {
        id(node.value)
        for node in ast.walk(source)
        if isinstance(node, ast.Attribute) and node.attr == "isatty"
    }
    asked |= {
        id(node.value)
        for node in ast.walk(source)
        if isinstance(node, ast.Attribute) and node.attr == "flush"
    }
    found = set()
    for node in ast.walk(source):
        if isinstance(node, ast.Attribute) and _name(node) in {
            f"sys.{stream}" for stream in STREAMS
        }:
            found |= set() if id(node) in asked else {_name(node)}
        if isinstance(node, ast.Call):
            name = _name(node.func)
            own = {"print", "tqdm.write", "traceback.print_exc", *(f"click.{one}" for one in CLICK)}
            found |= {name} & own
    return found


def test_only_the_console_writes_to_a_terminal() -> None:
    found = {str(module.relative_to(ROOT)): printing(tree(module)) for module in modules(*PACKAGES)}
    assert found[PRINTER], "the test does not see what prints"
    assert {module for module, names in found.items() if names} - {PRINTER} == set(ALLOWED)
