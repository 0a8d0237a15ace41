"""Kinds of findings: one table of their severities, which names every kind that is made by it and
no other."""

from __future__ import annotations

import ast

import pytest

from flagdata.core.findings import SEVERITIES, Finding, Severity
from tests.contract.imports import modules, tree


def made() -> set[str]:
    """Kinds that the product makes by `Finding.of`."""
    kinds = set()
    for path in modules("flagdata", "sim", "models", "measure"):
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "Finding.of":
                assert isinstance(node.args[0], ast.Constant), f"{path}:{node.lineno}"
                kinds.add(str(node.args[0].value))
    return kinds


def test_every_kind_that_is_made_stands_in_the_table_and_no_other() -> None:
    assert made() == set(SEVERITIES)
    assert len(SEVERITIES) > 150


def test_a_kind_has_the_severity_of_the_table() -> None:
    assert Finding.of("gaps", "there are gaps", count=3, value=1.5) == Finding(
        kind="gaps", severity=Severity.WARNING, what="there are gaps", count=3, value=1.5
    )
    assert {Finding.of(kind, "").severity for kind in SEVERITIES} == set(Severity)


def test_a_kind_that_is_not_in_the_table_is_a_defect() -> None:
    with pytest.raises(KeyError):
        Finding.of("gapz", "there are gaps")
