"""One function commits: whatever changes what a lake shows passes the checks of
`flagdata.lake.commits`."""

from __future__ import annotations

import ast

from tests.contract.imports import PACKAGES, ROOT, modules

COMMITS = "flagdata/lake/commits.py"
PUBLISHING = {"append", "drop"}
"""Methods of the catalog that publish a version of rows."""


def publishers(source: str) -> list[int]:
    """Lines at which a version is published by a catalog."""
    return [
        node.lineno
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr in PUBLISHING
        and isinstance(node.func.value, ast.Attribute)
        and node.func.value.attr == "catalog"
    ]


def test_a_call_that_publishes_is_found() -> None:
    assert publishers(
        "lake.catalog.append(rows, base=1, info={})\nlines.append(3)\nself._lake.catalog.drop(x)"
    ) == [
        1,
        3,
    ]


def test_only_the_commit_publishes() -> None:
    found = {
        path.relative_to(ROOT).as_posix()
        for path in modules(*PACKAGES)
        if publishers(path.read_text())
    }
    assert found == {COMMITS}
