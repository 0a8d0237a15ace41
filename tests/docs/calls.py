"""What the docstrings of the public calls hold: their examples and the parameters that they
describe."""

from __future__ import annotations

import inspect
import re

import flagdata


def lines(name: str) -> int:
    """Lines of a call's main use, the import counted."""
    return 1 + len([line for line in example(name).splitlines() if line.strip()])


def undocumented(name: str) -> set[str]:
    """Parameters of a call that its docstring says nothing of."""
    function = getattr(flagdata, name)
    _, _, arguments = (inspect.getdoc(function) or "").partition("Args:\n")
    told = re.findall(r"^    (\w[\w, ]*): ", arguments.partition("\n\n")[0], re.MULTILINE)
    return set(inspect.signature(function).parameters) - {
        one.strip() for names in told for one in names.split(",")
    }


def example(name: str) -> str:
    """The example in a call's docstring."""
    found = re.search(
        r"```python\n(.*?)```", inspect.getdoc(getattr(flagdata, name)) or "", re.DOTALL
    )
    return found[1] if found else ""
