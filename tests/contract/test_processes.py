"""How worker processes start is stated where they are made: Python's own choice differs between its
versions."""

from __future__ import annotations

import ast

from tests.contract.imports import ROOT, modules, tree

STATED_BY = {"ProcessPoolExecutor": "mp_context", "DataLoader": "multiprocessing_context"}
OF_NO_STATED_START = frozenset({"Process", "Pool", "Manager"})
"""Names of multiprocessing itself; those of a context of it are its methods."""


def unstated(source: ast.Module) -> list[int]:
    """Lines of the calls that make processes without stating how they start."""
    calls = [node for node in ast.walk(source) if isinstance(node, ast.Call)]
    return [
        call.lineno
        for call in calls
        if (called := ast.unparse(call.func))
        in {f"multiprocessing.{name}" for name in OF_NO_STATED_START}
        or (
            (option := STATED_BY.get(called.rpartition(".")[2]))
            and option not in {word.arg for word in call.keywords}
        )
    ]


def test_every_worker_process_states_how_it_starts() -> None:
    source = (
        "pool = ProcessPoolExecutor(2)\nfutures.ProcessPoolExecutor(2, "
        "mp_context=spawn)\nmultiprocessing.Pool()"
    )
    assert unstated(ast.parse(source)) == [1, 3]
    places = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in modules("flagdata", "sim", "models", "measure")
        for line in unstated(tree(path))
    ]
    assert not places
