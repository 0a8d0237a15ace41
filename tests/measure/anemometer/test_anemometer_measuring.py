"""Films read by a reading model, and why one is refused. What is looked at in a film is
replaced."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flagdata.core.findings import Finding, Severity
from flagdata.core.json_values import json_values
from flagdata.core.stated import Stated
from flagdata.errors import CorruptError, UsageError
from measure.anemometer import ReadingCalibration, anemometer_measuring
from measure.estimate import Measurement, Options, beside
from measure.film import FlagSize
from measure.measuring_model import Features, Place
from measure.measuring_model.novelty import Compared
from measure.measuring_model.reading_model_folder import read, write
from models.networks.targets import TARGETS
from tests.measure.anemometer.made import SIZE, STEP, features, gusts, model, place

Measure = Callable[..., Measurement]


def bare(where: Place) -> Place:
    """The same before a cloudless sky."""
    return replace(where, background=np.full((64, 64), 90.0, np.float32))


@pytest.fixture(scope="module")
def found() -> ReadingCalibration:
    return model()


@pytest.fixture
def measure(found: ReadingCalibration, monkeypatch: pytest.MonkeyPatch) -> Measure:
    """Measure a film of these features."""
    estimator: Any = SimpleNamespace(targets=(TARGETS["wind_speed"],))

    def measured(
        own: Features, *, options: Options | None = None, findings: tuple[Finding, ...] = ()
    ) -> Measurement:
        film: Any = SimpleNamespace(
            name="film", rate=25.0, duration=240.0, findings=lambda: findings
        )
        monkeypatch.setattr(anemometer_measuring, "features_of", lambda *_, **__: own)
        return anemometer_measuring.measure_by(
            film, found.model, estimator, options or Options(), name="garden"
        )

    return measured


def test_the_same_flag_on_another_day_is_read_window_by_window(
    measure: Measure, found: ReadingCalibration
) -> None:
    wind = gusts(120.0, seed=21)
    own = measure(features(wind, seed=21))
    assert not own.verdict.refused
    assert own.model == "garden"
    times, speed = wind
    truth = np.array(
        [speed[(times >= a) & (times < a + STEP)].mean() for a in STEP * np.arange(100)]
    )
    series = beside(own, start=None, wind=None)
    assert np.sqrt(np.mean((series.wind - truth) ** 2)) < 0.2
    np.testing.assert_allclose(series.high - series.low, 2 * found.half_width)
    (whole,) = own.quantities
    assert whole.span.low < truth.mean() < whole.span.high
    # The mean of 100 windows is known better than a window, but not as if they were independent.
    assert found.model.rmse / 10 < (whole.sigma or 0.0) < found.model.rmse / 2
    assert "wind" in own.sentence


@pytest.mark.parametrize(
    ("changed", "kind"),
    [
        ({"other": 4.0}, "another-flag"),
        ({"where": place(seed=5)}, "another-place"),
        ({"where": bare(place(shifted=1.0))}, "another-framing"),
    ],
)
def test_another_flag_or_place_is_refused_with_its_figure(
    measure: Measure, changed: dict[str, Any], kind: str
) -> None:
    own = measure(features(gusts(120.0, seed=21), seed=21, **changed))
    assert own.verdict.refused
    assert [reason.kind for reason in own.verdict.reasons if reason.p is None] == [kind]
    assert f"{own.verdict.reasons[0].value:.2f}" in own.verdict.sentence


def test_a_film_of_few_windows_is_no_more_another_flag_than_a_long_one(
    found: ReadingCalibration,
) -> None:
    """The mean of three windows scatters by 1/√3 of a window's scatter or more, which is no shift;
    a shift of one feature of six by four deviations is √(16/6) in each."""
    shifts = []
    for seed in range(30, 42):
        own = features(gusts(6.1, seed=seed), seed=seed)
        used = found.model.used(own)
        shifts.append(found.model.familiar.shift(used, found.model.read(used)) or 0.0)
    assert np.sqrt(np.nanmean(np.square(shifts))) < 0.5
    assert np.isfinite(shifts).sum() > 6
    far = features(gusts(120.0, seed=21), seed=21, other=4.0)
    used = found.model.used(far)
    assert found.model.familiar.shift(used, found.model.read(used)) == pytest.approx(
        np.sqrt(16 / 6), rel=0.15
    )


def test_a_short_calibration_does_not_recognise_the_flag_and_says_so(
    found: ReadingCalibration,
) -> None:
    few = replace(
        found.model.familiar, distances=found.model.familiar.distances[:17]
    )  # of six features, three each
    own = features(gusts(120.0, seed=21), seed=21, other=4.0)
    used = found.model.used(own)
    shift = few.shift(used, found.model.read(used))
    assert shift is None
    judged = Compared.of(shift, place(), (place(),))
    assert judged.reasons() == []
    assert "too short to recognise the flag" in judged.figures


def test_another_size_and_a_fault_of_the_film_refuse_it(measure: Measure) -> None:
    own = features(gusts(120.0, seed=21), seed=21)
    fault = Finding(
        kind="cut-off", severity=Severity.WARNING, what="the edge cuts the cloth off", value=0.5
    )
    both = measure(own, options=Options(size=FlagSize(length=2.0, height=1.0)), findings=(fault,))
    assert [reason.kind for reason in both.verdict.faults] == ["cut-off", "another-size"]
    assert "1 more reason" in both.verdict.sentence
    assert not measure(own, options=Options(size=SIZE)).verdict.refused


def test_the_hoist_counts_where_no_background_shows_the_place(measure: Measure) -> None:
    moved = place(shifted=1.0)
    assert not measure(features(gusts(120.0, seed=21), seed=21, where=moved)).verdict.refused
    other = bare(replace(place(), side=-1.0))
    assert (
        "on the other side"
        in measure(features(gusts(120.0, seed=21), seed=21, where=other)).verdict.sentence
    )


def test_a_picture_of_another_shape_is_refused_and_one_without_details_is_judged_by_the_rest(
    measure: Measure,
) -> None:
    own = place()
    wide = replace(own, background=own.background[:36], bare=own.bare[:36])
    found = measure(features(gusts(120.0, seed=21), seed=21, where=wide))
    assert [reason.kind for reason in found.verdict.faults] == ["another-picture"]
    judged = measure(features(gusts(120.0, seed=21), seed=21, where=bare(own))).verdict
    assert not judged.refused
    assert "no background shows the place" in judged.sentence


def test_a_brighter_day_is_the_same_place(measure: Measure) -> None:
    own = place()
    light = np.linspace(0.5, 1.5, 64, dtype=np.float32) * own.background + 20.0
    assert not measure(
        features(gusts(120.0, seed=21), seed=21, where=replace(own, background=light))
    ).verdict.refused


def test_winds_beyond_the_calibration_are_reported(
    measure: Measure, found: ReadingCalibration
) -> None:
    times, speed = gusts(120.0, seed=21)
    own = measure(features((times, speed + 3.0), seed=21))
    (beyond,) = (one for one in own.findings if one.kind == "beyond-calibration")
    high = found.model.range[1]
    assert beyond.count == sum(w.quantity("wind_speed").value > high for w in own.windows)  # type: ignore[operator]
    assert beyond.count > 50
    assert [reason.kind for reason in own.verdict.faults] == ["another-wind"]


def test_options_of_networks_are_refused(measure: Measure) -> None:
    own = features(gusts(120.0, seed=21), seed=21)
    with pytest.raises(UsageError, match="knows its flag") as told:
        measure(own, options=Options(area_weight=Stated(low=0.1, high=0.2)))
    assert told.value.where == "--area-weight"
    with pytest.raises(UsageError, match=r"1\.2 s long"):
        measure(own, options=Options(step=0.6))


def test_a_model_is_the_same_once_it_was_stored(found: ReadingCalibration, tmp_path: Path) -> None:
    write(tmp_path / "model.zarr", found.model, json_values(found))
    again = read(tmp_path / "model.zarr")
    own = features(gusts(120.0, seed=21), seed=21)
    np.testing.assert_array_equal(
        again.read(again.used(own)), found.model.read(found.model.used(own))
    )
    assert (again.size, again.names, again.block) == (
        found.model.size,
        found.model.names,
        found.model.block,
    )
    used, winds = again.used(own), again.read(again.used(own))
    assert again.familiar.shift(used, winds) == found.model.familiar.shift(used, winds)
    with pytest.raises(CorruptError, match="damaged"):
        read(tmp_path / "nothing.zarr")
