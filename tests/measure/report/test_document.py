"""The JSON document."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import Any

import pytest

from flagdata.answer import Quantity
from flagdata.errors import InputError
from measure.report import as_document, from_document
from measure.verdict import Conclusion, Verdict, estimate_text
from measure.verdict.quantity import NONE
from tests.golden_answers import changes
from tests.measure.report.verdicts import Size, verdict, with_holes


def written(whole: Verdict) -> dict[str, Any]:
    """Through text and back, with NaN refused."""
    return json.loads(json.dumps(as_document(whole), allow_nan=False))


def differences(a: Any, b: Any, where: str = "") -> list[str]:
    """Where two verdicts differ; NaN equals NaN, and the cloth in motion is rounded to float32."""
    if dataclasses.is_dataclass(a) and type(a) is type(b):
        return [
            d
            for f in dataclasses.fields(a)
            for d in differences(getattr(a, f.name), getattr(b, f.name), f.name)
        ]
    if isinstance(a, list | tuple) and type(a) is type(b) and len(a) == len(b):
        return [
            d
            for n, (x, y) in enumerate(zip(a, b, strict=True))
            for d in differences(x, y, f"{where}[{n}]")
        ]
    if (
        isinstance(a, float)
        and isinstance(b, float)
        and where.startswith(("observed", "before[", "after["))
    ):
        same = math.isclose(a, b, rel_tol=2**-24) or (math.isnan(a) and math.isnan(b))
        return [] if same else [f"{where}: {a!r} ≠ {b!r}"]
    same = a == b or (
        isinstance(a, float) and isinstance(b, float) and math.isnan(a) and math.isnan(b)
    )
    return [] if same else [f"{where}: {a!r} ≠ {b!r}"]


@pytest.mark.parametrize("conclusion", Conclusion)
def test_every_field_of_every_kind_of_verdict_comes_back(conclusion: Conclusion) -> None:
    whole = verdict(conclusion)
    assert differences(from_document(written(whole)), whole) == []


def test_documents_are_what_they_were() -> None:
    kinds, size = (
        (Conclusion.EFFECT, Conclusion.UNDECIDED),
        Size(across=2, up=2, frames=3, stretch=2),
    )
    documents = {conclusion.value: as_document(verdict(conclusion, size)) for conclusion in kinds}
    assert changes("verdicts-of-markers", documents, relative=1e-9) == []


def test_a_verdict_of_the_demonstrations_size_is_below_a_megabyte() -> None:
    """Two recordings of 60 markers and 100 frames, 50 of them in motion."""
    size = Size(across=10, up=6, frames=100, stretch=50)
    assert len(json.dumps(as_document(verdict(Conclusion.EFFECT, size)), indent=1)) < 1_000_000


def test_nested_lists_are_read_where_motion_was_not_packed() -> None:
    whole = verdict(Conclusion.EFFECT)
    document = written(whole)
    for own, made in zip(document["residuals"], whole.residuals, strict=True):
        own |= {"observed": made.observed, "before": made.before, "after": made.after}
    assert from_document(document) == whole


def test_packed_motion_that_is_damaged_is_refused_with_the_place() -> None:
    document = written(verdict(Conclusion.EFFECT))
    document["residuals"][1]["after"]["shape"] = [2, 2, 3]
    with pytest.raises(InputError, match="packed") as refused:
        from_document(document)
    assert refused.value.where == "verdict.residuals[1].after"


def test_missing_numbers_and_open_intervals_come_back() -> None:
    whole = with_holes(verdict(Conclusion.EFFECT))
    document = written(whole)
    assert document["residuals"][0]["speed"] is None
    assert document["ranking"][0]["strength"]["high"] == "Infinity"
    assert differences(from_document(document), whole) == []


@pytest.mark.parametrize(
    ("stated", "text"),
    [
        ({"value": 0.35, "low": 0.35, "high": "Infinity", "bound": "at-least"}, "at least 0.35"),
        ({"value": 2.0, "low": 0.0, "high": 2.0, "bound": "at-most"}, "at most 2"),
        ({"value": 1.0, "low": 0.0, "high": "Infinity", "bound": "nothing"}, "not determined"),
        ({"value": None, "low": None, "high": None, "bound": None}, NONE),
    ],
)
def test_a_quantity_of_a_stored_document_is_read_and_written_as_it_was(
    stated: dict[str, Any], text: str
) -> None:
    document = written(verdict(Conclusion.EFFECT))
    document["ranking"][0]["strength"] = stated | {"unit": "1", "level": 0.95}
    again = from_document(document)
    assert estimate_text(again.ranking[0].strength).startswith(text)
    assert written(again) == document


def test_a_document_that_does_not_state_whether_another_draw_could_decide_otherwise_is_read() -> (
    None
):
    document = written(verdict(Conclusion.EFFECT))
    for name in ("open", "settling"):
        del document["test"][name]
    assert from_document(document).test.open is None


def test_the_document_holds_every_field_by_its_name() -> None:
    """Walked beside the dataclasses, so that a field added to the verdict cannot be left out."""

    def walk(value: Any, document: Any) -> None:
        if isinstance(value, Quantity):
            assert list(document) == ["value", "low", "high", "unit", "level", "bound"]
        elif dataclasses.is_dataclass(value):
            assert document.keys() == {f.name for f in dataclasses.fields(value)}
            for field in dataclasses.fields(value):
                walk(getattr(value, field.name), document[field.name])
        elif isinstance(value, tuple) and value and dataclasses.is_dataclass(value[0]):
            for inner, content in zip(value, document, strict=True):
                walk(inner, content)

    document = written(verdict(Conclusion.PARTLY))
    assert document.pop("schema") == "flagdata.verdict/1"
    walk(verdict(Conclusion.PARTLY), document)


@pytest.mark.parametrize(
    ("change", "where", "what"),
    [
        ({"schema": "flagdata.verdict/2"}, "verdict", "flagdata.verdict/2"),
        ({"conclusion": "perhaps"}, "verdict.conclusion", "perhaps"),
        ({"seconds": "long"}, "verdict.seconds", "of type str, not a number"),
        ({"seconds": True}, "verdict.seconds", "of type bool, not a number"),
        ({"named": "lift"}, "verdict.named", "of type str, not a list"),
        ({"findings": [["kind"]]}, "verdict.findings[0]", "1 entries"),
        ({"colour": "blue"}, "verdict", "unknown field colour"),
        (
            {"test": {"statistic": 1.0}},
            "verdict.test",
            "lacks the field critical, kinds, level, null, nulls, p_value",
        ),
    ],
)
def test_a_document_that_does_not_fit_is_refused_with_the_place(
    change: dict[str, Any], where: str, what: str
) -> None:
    with pytest.raises(InputError) as refused:
        from_document({**written(verdict(Conclusion.SUFFICIENT)), **change})
    assert refused.value.where == where
    assert what in refused.value.what
