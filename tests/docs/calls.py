"""What the docstrings of the public calls hold: their examples and the parameters that they
describe."""

from __future__ import annotations

import inspect
import re

import flagdata


def lines(name: str) -> int:
    """Lines of a call's main use, the import counted."""
    return 1 + len([line for line in example(name).splitlines() if line.strip()])


def descriptions(name: str) -> dict[str, str]:
    """Parameter of a call → what its docstring says of it."""
    _, _, arguments = (inspect.getdoc(getattr(flagdata, name)) or "").partition("Args:\n")
    entries = re.findall(
        r"^    (\w[\w, ]*): (.*(?:\n {5,}.*)*)", arguments.partition("\n\n")[0], re.MULTILINE
    )
    return {one.strip(): text for names, text in entries for one in names.split(",")}


def undocumented(name: str) -> set[str]:
    """Parameters of a call that its docstring says nothing of."""
    return set(inspect.signature(getattr(flagdata, name)).parameters) - set(descriptions(name))


def example(name: str) -> str:
    """The example in a call's docstring."""
    found = re.search(
        r"```python\n(.*?)```", inspect.getdoc(getattr(flagdata, name)) or "", re.DOTALL
    )
    return found[1] if found else ""
