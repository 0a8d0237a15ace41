"""Calls of the site whose options a class states: their signature and docstring are those that
Python has of them."""

from __future__ import annotations

import inspect
from importlib import import_module
from typing import Any

from griffe import Docstring, Extension, Function, Parameter, ParameterKind, Parameters


class Called(Extension):
    """Gives a function that `flagdata.verbs.verb_options.make_call` or `verb` made the parameters
    and docstring of run time."""

    def on_function(self, *, func: Function, **_: Any) -> None:
        """Replaces them; called by griffe, which reads source and runs none."""
        if not any(str(one.value).startswith(("called(", "verb(")) for one in func.decorators):
            return
        call = getattr(import_module(func.module.path), func.name)
        func.parameters = Parameters(*map(_parameter, inspect.signature(call).parameters.values()))
        func.docstring = Docstring(inspect.getdoc(call) or "", parent=func)


def _parameter(one: inspect.Parameter) -> Parameter:
    required = one.default is inspect.Parameter.empty
    kind = ParameterKind[one.kind.name.lower()]
    return Parameter(
        one.name,
        kind=kind,
        annotation=one.annotation,
        default=None if required else repr(one.default),
    )
