"""The page holds what the verdict holds, whatever its kind, and nothing from anywhere else."""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

from flagdata.answer import Quantity
from measure.verdict import Conclusion, Verdict
from tests.measure.report.pages import page, parsed
from tests.measure.report.verdicts import Size, residual, verdict, with_holes

KINDS = [*(c.name.lower() for c in Conclusion), "holes"]
POWERS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")
NUMBER = re.compile(r"(−?\d+(?:\.(\d+))?)(?: × 10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?")


def numbers(value: Any) -> Iterator[float]:
    """Every number a verdict holds."""
    if isinstance(value, bool):
        return
    if isinstance(value, int | float):
        yield float(value)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        for field in dataclasses.fields(value):
            yield from numbers(getattr(value, field.name))
    elif isinstance(value, list | tuple):
        for item in value:
            yield from numbers(item)


def estimates(value: Any) -> Iterator[Quantity]:
    """Every interval a verdict holds."""
    if isinstance(value, Quantity):
        yield value
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        for field in dataclasses.fields(value):
            yield from estimates(getattr(value, field.name))
    elif isinstance(value, tuple):
        for item in value:
            yield from estimates(item)


@pytest.fixture(scope="module", params=KINDS)
def whole(request: pytest.FixtureRequest) -> Verdict:
    """A verdict of each kind."""
    if request.param == "holes":
        return with_holes(verdict(Conclusion.EFFECT))
    return verdict(Conclusion[request.param.upper()])


@pytest.fixture(scope="module")
def html(whole: Verdict) -> str:
    """Its page."""
    return page(whole)


def rounds_to(value: float, text: str, factor: float) -> bool:
    """Whether the first number of `text` is `value · factor`, to half of its last digit that is not
    a zero."""
    if math.isinf(value):
        return text.strip() == ("∞" if value > 0 else "−∞")
    found = NUMBER.search(text)
    assert found, text
    power = 10.0 ** int(found[3].translate(POWERS)) if found[3] else 1.0
    zeros = len(found[1]) - len(
        found[1].rstrip("0")
    )  # of a whole number, which may have been rounded to hundreds
    place = 10.0 ** (-len(found[2]) if found[2] else zeros)
    return abs(float(found[1].translate(POWERS)) * power - value * factor) <= 0.5001 * place * power


def test_every_number_on_the_page_is_one_of_the_verdict_rounded(whole: Verdict, html: str) -> None:
    known = set(numbers(whole))
    shown = parsed(html).all("data")
    assert len(shown) > 30
    for element in shown:
        value = float(element.attributes["value"])
        assert value in known
        factor = 1e3 if re.search(r"\bm[ms]\b", element.text) and "m/s" not in element.text else 1.0
        assert rounds_to(value, element.text, factor), (value, element.text)


def test_every_interval_on_the_page_is_that_of_its_value(whole: Verdict, html: str) -> None:
    held = list(estimates(whole))
    elements = parsed(html).elements
    seen = 0
    for element, follower in itertools.pairwise(elements):
        if (
            element.tag != "data"
            or follower.attributes.get("class") != "ends"
            or not follower.text.startswith("[")
        ):
            continue
        low, high = follower.text[1:].split("]")[0].split(", ")
        value = float(element.attributes["value"])
        factor = 1e3 if re.search(r"\bm[ms]$", element.text) else 1.0
        matching = [e for e in held if e.value == value]
        assert any(
            rounds_to(e.low, low, factor) and rounds_to(e.high, high, factor) for e in matching
        )
        seen += 1
    assert seen > 10


def test_the_page_is_well_formed(whole: Verdict, html: str) -> None:
    read = parsed(html)
    assert read.faults == []
    assert [e.tag for e in read.open] == []
    identities = [e.attributes["id"] for e in read.elements if "id" in e.attributes]
    assert len(identities) == len(set(identities))


def test_the_page_refers_to_no_other_file(whole: Verdict, html: str) -> None:
    for element in parsed(html).elements:
        for name in ("src", "href", "data", "action", "srcset", "poster"):
            assert element.attributes.get(name, "data:").startswith(("data:", "#")), element
        assert element.tag not in ("link", "iframe", "object", "embed", "base")
    assert "://" not in html
    assert "@import" not in html
    assert not re.search(r"url\((?!\s*[\"']?(?:data:|#))", html)


def test_charts_tables_and_controls_have_labels_for_screen_readers(
    whole: Verdict, html: str
) -> None:
    """Every chart has a name, every table's heads have a scope, every control a label."""
    read = parsed(html)
    for svg in read.all("svg"):
        assert svg.attributes.get("aria-label") or svg.attributes.get("aria-hidden") == "true"
    assert all(e.attributes.get("scope") in ("col", "row") for e in read.all("th"))
    for control in (*read.all("select"), *read.all("input")):
        assert "label" in control.inside
    assert len(read.all("h1")) == 1
    assert parsed(html).all("html")[0].attributes["lang"] == "en"


def test_the_page_says_the_verdicts_words_assumptions_and_remarks(
    whole: Verdict, html: str
) -> None:
    text = re.sub(r"\s+", " ", parsed(html).all("body")[0].text)
    sentences = [
        whole.words,
        whole.separating,
        whole.proposal,
        whole.test.nulls,
        *whole.assumptions,
    ]
    sentences += [c.why_not for c in whole.ranking if c.effect not in whole.named]
    sentences += [part for finding in whole.findings for part in finding]
    sentences += [part for effect in (*whole.unweighed, *whole.copied) for part in effect]
    for sentence in filter(None, sentences):
        assert sentence in text


def test_a_sufficient_base_model_has_no_columns_for_an_effect() -> None:
    html = page(verdict(Conclusion.SUFFICIENT))
    heads = [e.text for e in parsed(html).all("th")]
    assert not any("reduction" in h or "control" in h or "shift" in h for h in heads)
    shown = re.sub("<script.*?</script>", "", html, flags=re.DOTALL)
    assert "nan" not in shown.replace("nance", "").lower()
    # Bars of one model would all be 100 % long; its errors and their floors are in the table.
    assert "How much it matters" not in html
    assert "How much it matters" in page(verdict(Conclusion.EFFECT))
    assert "Error on unseen data" in html


def test_whether_a_strength_is_one_in_all_recordings_is_shown_beside_them() -> None:
    read = parsed(page(verdict(Conclusion.EFFECT)))
    assert any("for the same in all recordings" in head.text for head in read.all("th"))
    assert [cell.text for cell in read.all("data")].count("0.83") == 7


def test_missing_numbers_are_dashes() -> None:
    read = parsed(page(with_holes(verdict(Conclusion.EFFECT))))
    dashes = [e for e in read.classed("none") if e.text == "—"]
    assert len(dashes) >= 7  # the candidate that could not be weighed
    assert not [e for e in read.all("td") if re.search(r"\bnan\b|\bNone\b|\binf\b", e.text)]


def test_names_cannot_smuggle_markup() -> None:
    bad = "</script><script>alert('\"&')</script>"
    whole = verdict(Conclusion.EFFECT)
    first = whole.ranking[0]
    smuggled = replace(
        whole,
        named=(bad,),
        words=bad,
        ranking=(replace(first, effect=bad, parameter=bad), *whole.ranking[1:]),
        residuals=tuple(replace(r, recording=bad) for r in whole.residuals),
        comparisons=tuple(replace(c, what=bad, control_name=bad) for c in whole.comparisons),
        findings=((bad, bad),),
        assumptions=(bad,),
        provenance={bad: bad},
    )
    html = page(smuggled)
    read = parsed(html)
    assert read.faults == []
    assert len(read.all("script")) == len(parsed(page(whole)).all("script"))
    assert re.findall(r"(?<!script&gt;)alert\('", html) == []  # text of a chart, and nothing else
    assert bad in read.all("h1")[0].text


def test_three_recordings_of_twice_the_usual_size_fit_into_three_megabytes() -> None:
    whole = verdict(Conclusion.EFFECT)
    large = Size(across=25, up=20, frames=600, stretch=100)
    recordings = tuple(
        residual(f"{n}", 4.0 + n, held_out=n == 2, with_after=True, seed=n, size_of=large)
        for n in range(3)
    )
    assert len(page(replace(whole, residuals=recordings)).encode()) <= 3e6


def test_markers_on_a_line_are_shown_along_it() -> None:
    """A sheet's edge tracked from above has no area to colour."""
    whole = verdict(Conclusion.EFFECT)
    edge = replace(Size(), up=1)
    recordings = tuple(
        residual(f"{n}", 4.0 + n, held_out=n == 2, with_after=True, seed=n, size_of=edge)
        for n in range(3)
    )
    html = page(replace(whole, residuals=recordings))
    assert parsed(html).faults == []
    assert "along the markers [m]" in html
    assert "v [m]" not in html


def test_a_verdict_with_nothing_but_a_test_still_makes_a_page() -> None:
    whole = verdict(Conclusion.SUFFICIENT)
    bare = replace(
        whole,
        parameters=(),
        ranking=(),
        comparisons=(),
        residuals=(),
        assumptions=(),
        findings=(),
        provenance={},
        test=replace(
            whole.test,
            null=[],
            statistic=math.nan,
            critical=None,
            p_value=Quantity.of(value=math.nan, low=math.nan, high=math.nan, unit="1"),
        ),
    )
    assert parsed(page(bare)).faults == []


def test_the_same_verdict_makes_the_same_page() -> None:
    """Nothing random, no time of day."""
    assert page(verdict(Conclusion.PARTLY)) == page(verdict(Conclusion.PARTLY))
