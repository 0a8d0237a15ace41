"""`help` of a public call shows what it takes: a signature, a kind for each argument, and the unit
of each number."""

from __future__ import annotations

import inspect
import pydoc
import re

import pytest

import flagdata
from tests.docs.calls import descriptions

UNIT = re.compile(r"\[[^\]]+\]|\bSeconds\b|\bSI\b")
WITHOUT_UNIT = {"density_uncertainty", "false_alarm", "level"}
"""Numbers that are shares."""


@pytest.mark.parametrize("name", flagdata.__all__)
def test_the_help_of_a_call_shows_its_signature(name: str) -> None:
    call = getattr(flagdata, name)
    signature = inspect.signature(call)
    shown = " ".join(pydoc.plain(pydoc.render_doc(call)).split())
    assert f"{name}(" in shown
    for parameter in signature.parameters.values():
        assert parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
        assert parameter.annotation is not parameter.empty
        assert f"{parameter.name}: {parameter.annotation}" in shown
    assert signature.return_annotation is not signature.empty
    assert f"-> {signature.return_annotation}" in shown


@pytest.mark.parametrize("name", flagdata.__all__)
def test_the_help_of_a_call_states_the_unit_of_each_number(name: str) -> None:
    told = descriptions(name)
    numbers = [
        parameter.name
        for parameter in inspect.signature(getattr(flagdata, name)).parameters.values()
        if "float" in str(parameter.annotation) and parameter.name not in WITHOUT_UNIT
    ]
    assert [one for one in numbers if not UNIT.search(told[one])] == []
