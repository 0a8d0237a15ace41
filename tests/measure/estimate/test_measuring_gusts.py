"""A film measured by a model whose card states how it errs in windows: one gusty series, coherent
with its mean."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flagdata.core.stated import Stated
from flagdata.ingest.films.film_array import Frames
from measure.commands.measure import _Done, _report
from measure.estimate import SERIES_KEY, Measurement, Options, Pair, SeriesErrors, beside, measure
from models.trained.estimator import Estimator
from tests.measure.estimate.conftest import FRAMES, RATE, even
from tests.measure.estimate.test_film_measuring import APART, WHOLE, Listed, far
from tests.measure.estimate.test_measurement_page import answered

ERRORS = SeriesErrors(
    opened=Pair(shared=0.5, own=0.3),
    stated=Pair(shared=0.2, own=0.3),
    halves=0.4,
    neighbours=0.1,
    source="films that were made up",
)
LENGTH = FRAMES / RATE


@pytest.fixture(scope="module")
def series_model(model: Estimator) -> Estimator:
    return replace(model, card={**model.card, SERIES_KEY: ERRORS.entry()})


def measured(film: Frames, model: Estimator, **changes: object) -> Measurement:
    """Measures a film whose windows are all familiar."""
    options = replace(Options(size=WHOLE), **changes)  # type: ignore[arg-type]
    return measure(film, model, gate=Listed(*[0.5] * 200), dependence=APART, options=options)


def winds(found: Measurement) -> np.ndarray:
    """(window, 3) value, low and high."""
    quantities = [window.quantity("wind_speed") for window in found.windows]
    return np.array([[q.value, q.span.low, q.span.high] for q in quantities], dtype=float)


def kinds(found: Measurement) -> set[str]:
    return {finding.kind for finding in found.findings}


def test_the_films_wind_is_the_mean_of_its_windows_winds(series_model: Estimator) -> None:
    found = measured(even(6 * FRAMES), series_model)
    assert found.combined == 6
    assert found.quantities[0].value == pytest.approx(winds(found)[:, 0].mean(), rel=1e-9)
    assert found.draws[:, 0].mean() == pytest.approx(found.quantities[0].value, rel=1e-9)


def test_errors_smaller_than_the_networks_own_narrow_windows_and_film_and_leave_the_cloth(
    model: Estimator, series_model: Estimator
) -> None:
    film = even(6 * FRAMES)
    before, after = measured(film, model), measured(film, series_model)
    assert before.gusts is None
    assert (np.diff(winds(after)[:, 1:]) < 0.7 * np.diff(winds(before)[:, 1:])).all()
    for first, second in zip(before.quantities[1:], after.quantities[1:], strict=True):
        assert first == second
    for first, second in zip(before.windows, after.windows, strict=True):
        assert first.quantities[1:] == second.quantities[1:]
        assert (first.start, first.end, first.p) == (second.start, second.end, second.p)


def test_an_exact_weight_has_the_errors_of_a_stated_one_and_a_range_those_of_an_open_one(
    series_model: Estimator,
) -> None:
    # The cloth of the small model has next to no part in its wind: what differs are the constants.
    film = even(6 * FRAMES)
    width = {}
    for stated in (None, Stated.of(0.13), Stated.of("0.1:0.17")):
        found = measured(film, series_model, area_weight=stated)
        width[stated] = found.quantities[0].span.high - found.quantities[0].span.low
    opened, exact, ranged = width.values()
    assert exact < 0.7 * opened
    assert ranged == pytest.approx(opened, rel=0.3)


def test_one_window_and_a_model_without_constants_are_answered_as_before(
    model: Estimator, series_model: Estimator
) -> None:
    one = even(FRAMES)
    first, second = measured(one, model), measured(one, series_model)
    np.testing.assert_array_equal(first.draws, second.draws)
    assert [one.quantities for one in first.windows] == [one.quantities for one in second.windows]
    assert (second.gusts, kinds(second) & {"windows-apart"}) == (None, set())
    several = measured(even(3 * FRAMES), model)
    (note,) = [finding for finding in several.findings if finding.kind == "windows-apart"]
    assert f"how the model {model.name} errs in windows of one film was not measured" in note.what
    assert several.document(anyway=True)["gusts"] is None


def test_windows_that_bound_the_wind_are_no_series_and_keep_their_bounds(
    series_model: Estimator,
) -> None:
    found = measured(even(4 * FRAMES), far(series_model, 0, 1.0))
    assert found.gusts is None
    assert {window.quantity("wind_speed").value for window in found.windows} == {None}
    (note,) = [finding for finding in found.findings if finding.kind == "windows-apart"]
    assert note.count == 4


def test_a_strange_window_keeps_its_own_answer_and_its_mark(
    model: Estimator, series_model: Estimator
) -> None:
    film, p = even(6 * FRAMES), (0.5, 0.001, 0.4, 0.6, 0.5, 0.5)
    found, alone = (
        measure(film, one, gate=Listed(*p), dependence=APART, options=Options(size=WHOLE))
        for one in (series_model, model)
    )
    assert found.verdict.strange.tolist() == [False, True, False, False, False, False]
    assert found.windows[1].quantities == alone.windows[1].quantities
    assert found.windows[0].quantities != alone.windows[0].quantities
    assert found.gusts is not None
    assert (found.gusts.windows, found.combined) == (5, 5)


def test_windows_that_overlap_are_as_wide_as_others_and_say_no_more_of_the_gusts(
    series_model: Estimator,
) -> None:
    film = even(8 * FRAMES)
    apart = measured(film, series_model)
    overlapping = measured(film, series_model, step=LENGTH / 4)
    assert (len(apart.windows), len(overlapping.windows)) == (8, 29)
    assert overlapping.combined == 8
    assert apart.gusts is not None
    assert overlapping.gusts is not None
    assert overlapping.gusts.intensity.value == pytest.approx(apart.gusts.intensity.value, abs=0.05)
    width = [np.diff(winds(found)[:, 1:]).mean() for found in (apart, overlapping)]
    assert 0.7 * width[0] < width[1] <= 1.05 * width[0]


def test_an_unknown_size_is_a_series_at_each_size(series_model: Estimator) -> None:
    found = measured(even(8 * FRAMES, rate=50.0), series_model, size=None)
    assert found.gusts is not None
    assert found.quantities[0].value == pytest.approx(winds(found)[:, 0].mean(), rel=1e-9)


def test_the_gusts_are_in_the_json_and_in_the_terminal(
    series_model: Estimator, capsys: pytest.CaptureFixture[str]
) -> None:
    found = measured(even(6 * FRAMES), series_model)
    assert found.gusts is not None
    told = found.document(anyway=True)["gusts"]
    assert told["sentence"] == found.gusts.sentence
    assert told["interval"] == list(found.gusts.intensity.interval)
    subject: Any = SimpleNamespace(known=None)
    done = _Done(
        measured=found,
        series=beside(found, start=None, wind=None),
        subject=subject,
        refinement=None,
        answer=answered(found, series_model),
    )
    _report(done, series=True)
    assert f"  {found.gusts.sentence}\n" in capsys.readouterr().out
    (note,) = [finding for finding in found.findings if finding.kind == "windows-combined"]
    assert "one gusty wind" in note.what
    assert "films that were made up" in note.what


def test_python_has_the_gusts_with_their_interval(
    model: Estimator, series_model: Estimator
) -> None:
    film = even(6 * FRAMES)
    found = measured(film, series_model)
    assert found.gusts is not None
    gusts = answered(found, series_model).gusts
    assert gusts is not None
    assert (gusts.value, gusts.interval) == (
        found.gusts.intensity.value,
        found.gusts.intensity.interval,
    )
    assert gusts.constrained == found.gusts.intensity.constrained
    assert answered(measured(film, model), model).gusts is None
