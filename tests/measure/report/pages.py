"""Reads a page the way a strict parser does."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from html.parser import HTMLParser

from measure.report import answer_of_markers
from measure.verdict import Verdict

VOID = {"meta", "br", "input", "img", "link", "hr"}
SELF_CLOSED = {"path", "circle", "rect", "image"}


@dataclass(kw_only=True)
class Element:
    """A start tag, and the text directly and indirectly inside it."""

    tag: str
    attributes: dict[str, str]
    text: str = ""
    inside: tuple[str, ...] = ()


@dataclass(kw_only=True)
class Page(HTMLParser):
    """Every element in order, and what is wrong with their nesting."""

    elements: list[Element] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    open: list[Element] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__init__(convert_charrefs=True)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        element = Element(
            tag=tag,
            attributes={k: v or "" for k, v in attrs},
            inside=tuple(e.tag for e in self.open),
        )
        if len(element.attributes) != len(attrs):
            self.faults.append(f"{self.getpos()}: an attribute of <{tag}> stands twice")
        self.elements.append(element)
        if tag in SELF_CLOSED:
            self.faults.append(f"{self.getpos()}: <{tag}> is not closed")
        elif tag not in VOID:
            self.open.append(element)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append(Element(tag=tag, attributes={k: v or "" for k, v in attrs}))

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open[-1].tag != tag:
            self.faults.append(
                f"{self.getpos()}: </{tag}> where {[e.tag for e in self.open[-3:]]} are open"
            )
        else:
            self.open.pop()

    def handle_data(self, data: str) -> None:
        for element in self.open:
            element.text += data

    def all(self, tag: str) -> list[Element]:
        return [e for e in self.elements if e.tag == tag]

    def classed(self, name: str) -> list[Element]:
        return [e for e in self.elements if name in e.attributes.get("class", "").split()]


def page(verdict: Verdict) -> str:
    """The page of a verdict by markers."""
    return answer_of_markers(verdict).page


def page_of_words(verdict: Verdict) -> str:
    """The page without the charts of recordings, which take a second each."""
    return page(replace(verdict, residuals=()))


def parsed(html: str) -> Page:
    read = Page()
    read.feed(html)
    read.close()
    return read
