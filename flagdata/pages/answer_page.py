"""The page of an answer: one template for all questions. What comes out is one file that refers to
no other."""

from __future__ import annotations

from itertools import count

from markupsafe import Markup, escape

from flagdata.answer.answer import Answer, Figure, Gallery, Part, Section, Table
from flagdata.answer.charts import Chart
from flagdata.core.findings import Finding
from flagdata.core.provenance import code_version
from flagdata.pages.render import render


def render_answer(answer: Answer) -> str:
    """Renders the page, HTML."""
    provenance = {**answer.provenance, "code": code_version()}
    sections = list(answer.make_sections())
    said = {one.kind for one in answer.head.limits if isinstance(one, Finding)}
    if further := [one for one in answer.findings if one.kind not in said]:
        title = f"What {'else ' if said else ''}was noticed: {len(further)}"
        sections.append(Section(title=title, parts=[further], anchor="findings", folded=True))
    where = Section(
        title="Where it is from",
        parts=[Table.of_values(provenance)],
        anchor="provenance",
        folded=True,
    )
    numbers = count()
    values = {
        "answer": answer,
        "facts": Table.of_values(answer.head.facts),
        "sections": [*sections, where],
        "limits": [_sentences(one) for one in answer.head.limits],
        "kind_of": _kind_of,
        "draw": lambda figure: _draw(figure, f"figure-{next(numbers)}"),
    }
    return render("flagdata.pages", "answer.html.j2", values)


def _sentences(limit: str | Finding) -> str:
    """Makes sentences of what limits an answer, and of what to do about it."""
    said = [limit] if isinstance(limit, str) else [limit.what, limit.fix or ""]
    return " ".join(f"{one[0].upper()}{one[1:].rstrip('.')}." for one in said if one)


def _kind_of(part: Part) -> str:
    """Returns how a part is shown."""
    match part:
        case Table():
            return "table"
        case Figure():
            return "figure"
        case Gallery():
            return "gallery"
        case Markup():
            return "markup"
        case str():
            return "text"
        case _:
            return "findings"


def _draw(figure: Figure, name: str) -> Markup:
    """Draws a figure's content."""
    content = figure.content() if callable(figure.content) else figure.content
    if isinstance(content, Chart):
        from flagdata.pages.chart_drawing import svg

        drawn = svg(content, name=name, title=figure.title)
        if figure.width is None:
            return drawn
        return Markup('<div style="max-width: {}px">{}</div>').format(figure.width, drawn)
    if isinstance(content, Markup):
        return content
    width = "" if figure.width is None else Markup(' width="{}"').format(figure.width)
    return Markup('<img alt="{}" src="{}"{}>').format(figure.title, escape(content), width)
