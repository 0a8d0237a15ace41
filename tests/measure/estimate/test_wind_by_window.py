"""A wind series beside an anemometer: errors, spectra and delays that were put in come out."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from flagdata.answer import Bound, Quantity, Span
from flagdata.core.json_values import json_values
from flagdata.core.rng import stream
from flagdata.record.signals import Sensor, WindSeries
from flagdata.timebase import NANOSECONDS
from measure.estimate import Beside, Measurement, beside
from measure.estimate.wind_by_window import Spectrum, agreement, spectrum
from models.trained.estimator import Estimator
from tests.measure.estimate.conftest import FRAMES, even
from tests.measure.estimate.test_film_measuring import measured

STRONG = 9.4
START = 1_700_000_000 * NANOSECONDS


def gusts(count: int, *, correlation: float = 0.97) -> np.ndarray:
    rng = stream(3, "gusts")
    out = np.empty(count)
    level = 0.0
    for k in range(count):
        level = correlation * level + np.sqrt(1 - correlation**2) * rng.normal()
        out[k] = 5 + level
    return out


def log(times: np.ndarray, speed: np.ndarray) -> WindSeries:
    """Stamps in seconds from the film's first frame."""
    return WindSeries(
        time=START + np.round(times * NANOSECONDS).astype(np.int64),
        channels={"wind_speed": speed},
        flags=np.zeros(len(times), dtype=np.uint16),
        sensor=Sensor(name="sonic", averaging=0.0, distance_constant=0.0),
    )


def saying(model: Estimator, wind: np.ndarray, *, step: float) -> Measurement:
    """A measurement whose windows, one each `step`, say these winds ± 0.5 m/s, at least `STRONG`
    where they are NaN."""
    found = measured(even(2 * FRAMES), model)
    first = found.windows[0]
    quantity = replace(first.quantities[0], information=1.0)

    def said(v: float) -> Quantity:
        if math.isnan(v):
            least = Span(low=STRONG, high=math.inf, level=0.95, bound=Bound.LEAST, estimated=False)
            return replace(quantity, value=None, sigma=None, span=least)
        return replace(
            quantity,
            value=v,
            span=Span(low=v - 0.5, high=v + 0.5, level=0.9, bound=None, estimated=True),
        )

    windows = tuple(
        replace(first, start=k * step, end=k * step + 0.44, quantities=(said(v),))
        for k, v in enumerate(wind.tolist())
    )
    return replace(
        found, windows=windows, verdict=replace(found.verdict, window_p=(0.5,) * len(wind))
    )


def test_bias_and_rmse_are_those_that_were_put_in(model: Estimator) -> None:
    wind = gusts(100)
    found = beside(saying(model, wind + 0.3, step=1.0), start=START, wind=None)
    assert found.logged is None
    agreed = agreement(found, wind, seed=0)
    assert agreed is not None
    assert (agreed.bias, agreed.rmse) == (pytest.approx(0.3), pytest.approx(0.3))
    assert agreed.covered == 1
    shifted = agreement(found, wind - 1, seed=0)
    assert shifted is not None
    assert shifted.covered == 0
    assert agreement(found, np.full(100, np.nan), seed=0) is None


def test_the_rmse_of_few_windows_has_no_interval_and_that_of_many_has_one_about_it(
    model: Estimator,
) -> None:
    """Windows of 1.2 s without a gap: five blocks of 12 s are 50 of them."""
    off = np.random.default_rng(2).normal(0.0, 0.5, 200)
    wind = gusts(200)
    for count, known in ((15, False), (40, False), (50, True), (200, True)):
        found = beside(saying(model, (wind + off)[:count], step=1.2), start=START, wind=None)
        agreed = agreement(found, wind[:count], seed=0)
        assert agreed is not None
        assert agreed.rmse is not None
        assert (agreed.interval is not None) is known
        assert ("without an interval" in agreed.sentence) is not known
        if agreed.interval is not None:
            assert agreed.interval[0] < agreed.rmse < agreed.interval[1]
    # 200 errors of 0.5 m/s: the RMSE scatters by 0.5 / √400 = 0.025 m/s, its interval is 3.3 times
    # as wide.
    assert agreed.interval is not None
    assert agreed.interval[1] - agreed.interval[0] == pytest.approx(3.29 * 0.025, rel=0.4)


def test_windows_with_a_bound_count_where_intervals_are_compared_and_among_no_errors(
    model: Estimator,
) -> None:
    """Every second wind is 12 m/s, of which the model knows that it is 9.4 m/s or more; the others
    are read 0.3 m/s too high."""
    wind = np.where(np.arange(100) % 2, 12.0, gusts(100))
    series = beside(
        saying(model, np.where(wind == 12.0, np.nan, wind + 0.3), step=1.0), start=START, wind=None
    )
    agreed = agreement(series, wind, seed=0)
    assert agreed is not None
    assert (agreed.count, agreed.bounded, agreed.covered) == (100, 50, 1.0)
    assert (agreed.bias, agreed.rmse) == (pytest.approx(0.3), pytest.approx(0.3))
    assert "50 give a bound and no value" in agreed.sentence
    weak = agreement(series, np.minimum(wind, 9.0), seed=0)
    assert weak is not None
    assert weak.covered == 0.5
    assert spectrum(series.time, series.wind, wind) is None  # no two windows in a row have values


def test_a_series_of_bounds_alone_has_no_error_and_json_without_infinities(
    model: Estimator,
) -> None:
    strong = saying(model, np.full(200, np.nan), step=1.0)
    series = beside(strong, start=START, wind=log(np.arange(-70, 210, 1.0), np.full(280, 12.0)))
    assert series.window is not None
    assert (series.window.bias, series.window.covered) == (None, 1.0)
    assert series.delay is not None
    assert series.delay.offset is None
    json.dumps(json_values(series), allow_nan=False)
    header, first = list(series.rows())[:2]
    assert dict(zip(header, first, strict=True)) | {"time": "", "p": ""} == {
        "time": "",
        "wind": "",
        "low": "9.4",
        "high": "inf",
        "p": "",
        "anemometer": "12",
        "anemometer_minute": "12",
    }


def test_the_window_sees_its_own_wind_and_the_minute_the_mean_before_it(model: Estimator) -> None:
    # The wind rises from 0 by 0.1 m/s a second: a window of 0.44 s ends 0.22 s after its mean, a
    # minute 30 s.
    times = np.arange(-70, 40, 0.02)
    ramp = np.maximum(0.1 * (times + 70), 0)
    found = beside(saying(model, np.full(30, 7.0), step=1.0), start=START, wind=log(times, ramp))
    assert found.logged is not None
    assert found.minute is not None
    ends = np.arange(30) + 0.44
    np.testing.assert_allclose(found.logged, 0.1 * (ends - 0.22 + 70), atol=0.01)
    np.testing.assert_allclose(found.minute, 0.1 * (ends - 30 + 70), atol=0.01)


def test_series_that_share_a_slow_part_are_coherent_there_and_not_elsewhere() -> None:
    rng = stream(5, "coherence")
    time = np.arange(800) * 1.0
    slow = np.convolve(rng.normal(size=900), np.ones(20) / 20, mode="valid")[:800] * 6
    found = spectrum(time, slow + rng.normal(size=800) * 0.5, slow + rng.normal(size=800) * 0.5)
    assert found is not None
    below, above = found.frequency < 0.02, found.frequency > 0.2
    assert found.coherence[below].mean() > 0.8
    assert found.coherence[above].mean() < 0.5
    # Parseval: the density integrates to the variance.
    assert np.sum(found.logged) * found.frequency[0] == pytest.approx(np.var(slow) + 0.25, rel=0.3)


@pytest.mark.parametrize(
    ("coherence", "sentence"),
    [
        (
            (0.9, 0.7, 0.1, 0.2, 0.8),
            "Below 0.3 Hz, in gusts of more than 3.3 s, .*coherence 0.80.*; above, they are",
        ),
        ((0.9, 0.7, 0.1, 0.9, 0.8), "up to 0.5 Hz"),
        ((0.3, 0.2, 0.9, 0.9, 0.9), "nothing in common at any frequency"),
    ],
)
def test_the_frequency_up_to_which_film_and_anemometer_agree_is_reported(
    coherence: tuple[float, ...], sentence: str
) -> None:
    frequency = np.linspace(0.1, 0.5, 5)
    found = Spectrum(
        frequency=frequency,
        estimated=frequency,
        logged=frequency,
        coherence=np.array(coherence),
        chance=0.63,
        windows=40,
    )
    assert re.search(sentence, found.sentence)
    assert json_values(found)["sentence"] == found.sentence


def test_a_gap_or_a_constant_leaves_no_spectrum_of_what_is_too_short() -> None:
    time = np.arange(60) * 1.0
    wind = gusts(60)
    assert spectrum(time, wind, wind) is not None
    assert spectrum(np.concatenate([time[:30], time[30:] + 0.5]), wind, wind) is None
    assert spectrum(time, wind, np.full(60, 4.0)) is None


def test_the_delay_between_film_and_anemometer_is_found(model: Estimator) -> None:
    times = np.arange(-40, 640, 0.1)
    wind = gusts(len(times), correlation=0.99)
    rng = stream(6, "noise")
    seen = np.interp(np.arange(600) + 0.22, times, wind) + 0.3 * rng.normal(size=600)
    late = 4.2  # the anemometer's clock is ahead
    found = beside(
        saying(model, np.maximum(seen, 0), step=1.0), start=START, wind=log(times + late, wind)
    )
    assert found.delay is not None
    assert not found.delay.reasons
    assert found.delay.offset is not None
    assert found.delay.sigma is not None
    assert abs(found.delay.offset - late) < 3 * found.delay.sigma
    assert found.delay.sigma < 0.6


def test_a_short_film_has_no_delay_and_says_why(model: Estimator) -> None:
    found = beside(
        saying(model, gusts(30), step=1.0),
        start=START,
        wind=log(np.arange(-70, 40, 1.0), gusts(110)),
    )
    assert found.delay is not None
    assert found.delay.offset is None
    assert "shorter than 120 s" in found.delay.reasons[0]


def test_a_table_has_a_row_a_window_and_empty_cells_where_nothing_is_known() -> None:
    nothing = np.array([np.nan, 4.0])
    both = np.array([1.0, 2.0])
    found = Beside(
        time=both, wind=both, low=both, high=both, p=both, logged=nothing, minute=nothing
    )
    rows = list(found.rows())
    assert rows[0] == ["time", "wind", "low", "high", "p", "anemometer", "anemometer_minute"]
    assert rows[1][-2:] == ["", ""]
    assert rows[2][-1] == "4"
