"""Writes docs/api.md from the docstrings of the calls that flagdata exports: `python -m docs.generate_api`."""

from __future__ import annotations

import inspect
import re
import textwrap
from pathlib import Path

import flagdata

PAGE = Path(__file__).parent / "api.md"
TASKS = {
    "example": "A film with its truth, to try things on",
    "measure": "Wind and cloth from a film",
    "wind": "Samples of an anemometer",
    "frames": "Frames of a film as an array",
    "motion": "How much a film moves",
    "open": "A lake",
    "query": "Rows of its catalog",
    "pairs": "Clips with their wind, for training",
    "meshes": "A moving mesh as arrays",
    "simulate": "Cloth in the wind",
    "render": "A film of simulated cloth",
    "calibrate": "The cloth of a flag",
    "close_loop": "What the model of a cloth lacks",
}
"""Call → what it is for, in the order of the page."""
_HEAD = """# Python

<!-- Written by `python -m docs.generate_api`. -->

`import flagdata` gives the calls of this page and nothing else; each is imported when it is first used. They do what
the commands of the same names do, and return arrays. Angles are in radians and all else in SI, unless a name says
otherwise. In a notebook each result shows itself as a table, a film in motion.

| task | call | lines | documented |
|---|---|---|---|
"""


def reference() -> str:
    """The page."""
    rows = [f"| {task} | [`{name}`](#{name}) | {lines(name)} | {_documented(name)} |" for name, task in TASKS.items()]
    return _HEAD + "\n".join(rows) + "\n\n" + "\n".join(map(_section, TASKS))


def lines(name: str) -> int:
    """Lines of a call's main use, the import counted."""
    return 1 + len([line for line in example(name).splitlines() if line.strip()])


def _documented(name: str) -> str:
    return "no" if undocumented(name) else "yes"


def undocumented(name: str) -> set[str]:
    """Parameters of a call that its docstring says nothing of."""
    function = getattr(flagdata, name)
    _, _, arguments = (inspect.getdoc(function) or "").partition("Args:\n")
    told = re.findall(r"^    (\w[\w, ]*): ", arguments.partition("\n\n")[0], re.MULTILINE)
    return set(inspect.signature(function).parameters) - {one.strip() for names in told for one in names.split(",")}


def example(name: str) -> str:
    """The example in a call's docstring."""
    found = re.search(r"```python\n(.*?)```", inspect.getdoc(getattr(flagdata, name)) or "", re.DOTALL)
    return found[1] if found else ""


def _section(name: str) -> str:
    function = getattr(flagdata, name)
    parameters = ", ".join(_parameter(one) for one in inspect.signature(function).parameters.values())
    call = textwrap.fill(f"flagdata.{name}({parameters})", 110, subsequent_indent="    ", break_long_words=False)
    return f"## {name}\n\n```text\n{call}\n```\n\n{_body(inspect.getdoc(function) or '')}\n"


def _parameter(one: inspect.Parameter) -> str:
    return one.name if one.default is inspect.Parameter.empty else f"{one.name}={one.default!r}"


def _body(text: str) -> str:
    """A docstring as Markdown: its sections with a title, their entries as lists."""
    out: list[str] = []
    section = False
    for line in text.splitlines():
        entry = re.fullmatch(r"    (\S[^:]*): (.*)", line)
        if title := re.fullmatch(r"(Args|Raises|Returns|Attributes):", line):
            section = True
            names = {"Args": "Arguments", "Raises": "Errors"}
            out.append(f"**{names.get(title[1], title[1])}**\n")
        elif section and entry:
            out.append(f"- `{entry[1]}`: {entry[2]}" if "`" not in entry[1] else f"- {entry[1]}: {entry[2]}")
        elif section:
            out.append(line.removeprefix("    "))
        else:
            out.append(line)
    return "\n".join(out)


if __name__ == "__main__":
    PAGE.write_text(reference(), encoding="utf-8")
