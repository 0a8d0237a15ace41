"""The statistics of a calibration, on simulations whose law is known."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.answer import Bound
from flagdata.core.arrays import FloatArray
from flagdata.core.stated import parse
from flagdata.errors import InputError, RefusedError
from flagdata.recipes.typed_tables import Range
from measure.cloth import (
    CLOTH,
    OBSERVED,
    Calibration,
    CalibrationOptions,
    Design,
    Flag,
    Log,
    Normal,
    Observed,
    Uncertain,
    calibrate,
    designs_of,
    draws,
)
from measure.cloth import cloth_calibration as module
from measure.cloth import observed_recording as observed
from measure.cloth.calibration_answer import answer_of_calibration
from tests.measure.cloth.calibration.conftest import readings
from tests.studies.validation.looks import share, vtk

_AZIMUTH = Uncertain(
    name="azimuth",
    unit="rad",
    prior=Normal(mean=math.radians(70), sigma=math.radians(7)),
    source="stated",
)
_OPTIONS = CalibrationOptions(
    flag=Flag(length=1.5, height=1.0), azimuth=_AZIMUTH, simulations=128, seed=4
)
_GUSTY = 5.0 + 1.5 * np.sin(np.arange(-60.0, 130.0) / 4)


def _observed(
    weight: float, *, gain: float = 1.0, speed: FloatArray = _GUSTY, seed: int = 9
) -> Observed:
    log = Log(times=np.arange(-60.0, 130.0), speed=speed).cut(0.0, 120.0)
    starts = np.arange(48) * 2.5
    values = {
        "area_weight": np.array([weight]),
        "gain": np.array([gain]),
        "damping": np.array([0.01]),
        "azimuth": np.array([math.radians(70)]),
    }
    own = readings(values, log.mean_speed(starts, starts + 2.5), seed=seed)[0]
    return Observed(name=f"flag {weight}", source=f"{weight}, {seed}", readings=own, log=log)


def _sigma(places: int) -> float:
    """Of the logarithm of the weight: twice the gain's 3 %, of each place anew, and an error of the
    droop by the mesh of 0.0085, the same in all recordings, over 0.3."""
    return math.hypot(0.06 / math.sqrt(places), 0.0085 / 0.3)


def _spread(found: Calibration) -> float:
    """Standard deviation of the weight that is given."""
    assert found.weight.sigma is not None
    return found.weight.sigma


def _found(*recordings: Observed) -> Calibration:
    return calibrate(recordings, _OPTIONS, folder=Path("unused"))


@pytest.fixture(scope="module")
def plain(cheap: list[Design]) -> Calibration:
    """Of one recording of a flag of 0.17 kg/m²."""
    found = _found(_observed(0.17))
    assert [design.count for design in cheap] == [128]
    return found


def test_the_weight_is_known_as_well_as_twice_the_gain(plain: Calibration) -> None:
    weight = plain.weight
    # The ratio is known to 1 %, the gain to 3 %, and what numerics add to 3 %: the weight to 7 %.
    assert weight.value == pytest.approx(0.17, rel=0.05)
    assert _spread(plain) / 0.17 == pytest.approx(_sigma(1), rel=0.2)


def test_damping_is_determined_and_bending_is_not(plain: Calibration) -> None:
    _, bending, damping = plain.cloth.values()
    assert bending.value is None
    assert damping.value == pytest.approx(0.01, rel=0.15)
    assert any(
        finding.kind == "not-determined" and "bending" in finding.what for finding in plain.findings
    )


@pytest.mark.usefixtures("cheap")
def test_a_second_recording_with_an_error_of_its_own_narrows_the_weight(plain: Calibration) -> None:
    one, two = plain, _found(_observed(0.17), _observed(0.17, seed=10))
    assert _spread(two) / _spread(one) == pytest.approx(_sigma(2) / _sigma(1), rel=0.15)
    assert len(two.recordings) == 2


def test_simulations_left_out_lie_in_their_intervals(plain: Calibration) -> None:
    check = plain.check
    assert check.count == 48
    assert 34 <= check.held <= 48  # so few walkers leave 0.8 to 0.9
    assert 0.01 < check.median_error < 0.08


@pytest.mark.usefixtures("cheap")
def test_the_weight_of_a_flag_that_no_simulation_looks_like_is_withheld(plain: Calibration) -> None:
    own = _observed(0.17)
    strange = np.array(own.readings)
    strange[:, 3] += 1.0
    other = Observed(name="strange", source="x", readings=strange, log=own.log)
    found = _found(other)
    (finding,) = [one for one in found.findings if one.kind == "unlike-simulations"]
    assert "frequency" in finding.what.partition("too large")[0]
    assert [one.value for one in found.cloth.values()] == [None, None, None]
    np.testing.assert_allclose(
        found.weight.interval, found.weight.assumed, rtol=1e-3
    )  # what was assumed, no number
    assert found.stated is None
    assert (found.close_loop, found.area_weight_stated) == (None, None)
    assert found.sentence.startswith(
        "area weight: withheld, since no simulated flag looks like strange: frequency"
    )
    assert "unlike-simulations" not in {finding.kind for finding in plain.findings}


@pytest.mark.usefixtures("cheap")
def test_a_recording_unlike_all_simulations_is_left_out_and_the_others_weigh_the_flag() -> None:
    """A wrong crop, say: the weight is that of the others, and the reason is given."""
    good = [_observed(0.17), _observed(0.17, seed=10)]
    strange = np.array(_observed(0.17, seed=11).readings)
    strange[:, 3] += 1.0
    found = _found(*good, Observed(name="strange", source="x", readings=strange, log=good[0].log))
    assert found.withheld is None
    assert found.weight.value == pytest.approx(0.17, rel=0.1)
    assert len(found.recordings) == 2
    (left,) = [one for one in found.findings if one.kind == "left-out"]
    assert left.what.startswith("no simulated flag looks like strange (p = ")
    assert "frequency" in left.what.partition("too large")[0]


@pytest.mark.usefixtures("cheap")
@pytest.mark.parametrize(
    ("true", "words", "side", "end"),
    [(0.045, "at most 0.0", Bound.MOST, "0.05"), (0.5, "at least 0.4", Bound.LEAST, "0.45")],
)
def test_of_a_cloth_beyond_the_prior_a_bound_is_reported_and_no_number(
    plain: Calibration, true: float, words: str, side: Bound, end: str
) -> None:
    found = _found(_observed(true))
    assert found.weight.span.bound is side
    assert (
        found.weight.span.low <= true <= found.weight.span.high
    )  # beyond the prior, and not left out
    assert found.sentence.startswith(f"area weight {words}")
    assert " kg/m², 95 %, n = 48 windows" in found.sentence
    said = found.document
    weight = said["cloth"]["area_weight"]
    assert (weight["value"], weight["sigma"], weight["constrained"], weight["level"]) == (
        None,
        None,
        True,
        0.95,
    )
    assert weight["bound"] == side.value
    assert weight["interval"][0 if side is Bound.LEAST else 1] == pytest.approx(
        float(end), rel=0.15
    )
    assert (said["area_weight_stated"], said["close_loop"], found.stated) == (None, None, None)
    assert found.weighs
    (leaning,) = [one for one in found.findings if one.kind == "leans-on-prior"]
    assert leaning.what.startswith(
        "area weight: 10% of the posterior or more lie within 3% of the end of what"
    )
    assert f"{end} kg/m²" in leaning.what
    assert "leans-on-prior" not in {finding.kind for finding in plain.findings}
    assert "not-determined" not in {f.kind for f in found.findings if "area weight" in f.what}


@pytest.mark.usefixtures("cheap")
def test_a_bound_has_no_settled_box_and_no_line_to_copy_on_its_page(plain: Calibration) -> None:
    bounded = answer_of_calibration(_found(_observed(0.045)))
    assert '<p class="verdict open"><b>The cloth weighs at most 0.0' in bounded.page
    assert "--area-weight" not in bounded.page
    page = answer_of_calibration(plain).page
    assert '<p class="verdict settled"><b>The cloth weighs 0.1' in page
    assert str(plain.area_weight_stated) in page


def _uniform(low: float, high: float, *, stated: bool) -> Uncertain:
    limits = (low, high) if stated else (-math.inf, math.inf)
    return Uncertain(
        name="azimuth", unit="rad", prior=Range(low=low, high=high), source="", limits=limits
    )


def test_a_range_that_the_user_states_ends_an_interval_and_one_that_is_assumed_does_not() -> None:
    draws = np.linspace(0.95, 1.0, 1000)
    assumed = module.quantity(_uniform(0.0, 1.0, stated=False), draws, 0.9)
    assert (assumed.value, assumed.interval) == (None, (pytest.approx(0.9525, abs=1e-3), math.inf))
    stated = module.quantity(_uniform(0.0, 1.0, stated=True), draws, 0.9)
    assert stated.value == pytest.approx(0.975)
    assert stated.interval == (pytest.approx(0.9525, abs=1e-3), 1.0)


def test_a_normal_prior_has_no_end_that_a_posterior_could_lean_on() -> None:
    """A view that was misjudged by three standard deviations is a value, far from what was
    assumed."""
    found = module.quantity(_AZIMUTH, math.radians(91) + 0.01 * np.sin(np.arange(1000)), 0.9)
    assert found.value == pytest.approx(math.radians(91), abs=1e-3)
    assert found.span.bound is None


@pytest.mark.usefixtures("cheap")
def test_a_constant_wind_is_reported_to_leave_weight_to_what_is_assumed() -> None:
    (finding,) = [
        one
        for one in _found(_observed(0.17, speed=np.full(190, 5.0))).findings
        if "constant" in one.kind
    ]
    assert "gain and the weight act alike" in finding.what


@pytest.mark.usefixtures("cheap")
def test_an_error_of_pixels_widens_the_interval() -> None:
    own = _observed(0.17)
    sigma = np.zeros(len(OBSERVED))
    sigma[0] = 0.06  # of 0.3 ln weight: 20 %
    other = Observed(name="film", source="x", readings=own.readings, log=own.log, sigma=sigma)
    assert _spread(_found(other)) / 0.17 == pytest.approx(math.hypot(0.06, 0.2), rel=0.35)


def test_windows_lie_about_what_simulations_of_the_answer_show(plain: Calibration) -> None:
    (one,) = plain.recordings
    assert np.isfinite(one.middle[:, one.used]).all()
    assert (one.low[:, one.used] <= one.high[:, one.used]).all()
    error = one.observed.readings[:, 0] - one.middle[:, 0]
    assert float(np.abs(error).mean()) < 0.04  # the scatter of a window is 0.02


def test_the_answer_is_stated_as_measure_takes_it(plain: Calibration) -> None:
    assert plain.stated is not None
    stated = parse(str(plain.area_weight_stated))
    assert stated == plain.stated
    assert stated.low == pytest.approx(plain.weight.value, rel=1e-3)
    assert stated.sigma == pytest.approx(plain.weight.sigma, rel=0.05)
    assert parse(plain.document["close_loop"]["area-weight"]).low == pytest.approx(
        plain.weight.value, rel=1e-3
    )


def test_too_few_simulations_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def failed(design: Design, **_: object) -> FloatArray:
        return np.full((design.count, 48, len(OBSERVED)), np.nan)

    monkeypatch.setattr(module, "simulated_values", failed)
    with pytest.raises(RefusedError, match="0 of 128 simulations show what the film shows"):
        _found(_observed(0.17))


@pytest.mark.usefixtures("cheap")
def test_a_recording_that_simulations_do_not_show_is_left_out_of_two_and_named(
    monkeypatch: pytest.MonkeyPatch, plain: Calibration
) -> None:
    """The weight is that of the other alone."""
    cheaply = module.simulated_values

    def half(design: Design, **given: Any) -> FloatArray:
        every = cheaply(design, **given)
        return np.full_like(every, np.nan) if "0.3" in design.recording else every

    monkeypatch.setattr(module, "simulated_values", half)
    found = _found(_observed(0.3), _observed(0.17))
    assert [one.observed.name for one in found.recordings] == ["flag 0.17"]
    (left,) = [one for one in found.findings if one.kind == "left-out"]
    assert left.what.startswith(
        "flag 0.3 is left out: 0 of 128 simulations show what the film shows"
    )
    assert found.weight.value == pytest.approx(plain.weight.value, rel=0.03)


@pytest.mark.usefixtures("cheap")
def test_what_is_left_has_to_be_long_enough_too(monkeypatch: pytest.MonkeyPatch) -> None:
    cheaply = module.simulated_values

    def half(design: Design, **given: Any) -> FloatArray:
        every = cheaply(design, **given)
        return np.full_like(every, np.nan) if "0.3" in design.recording else every

    monkeypatch.setattr(module, "simulated_values", half)
    short = replace(_observed(0.17), readings=_observed(0.17).readings[:6])
    with pytest.raises(
        InputError, match=r"15 s of film have a log beside them; flag 0\.3 is left out: 0 of 128"
    ):
        _found(_observed(0.3), short)


def test_draws_fill_the_priors_range_evenly() -> None:
    found = draws(CLOTH, 64, seed=1, name="law")["area_weight"]
    low, high = 0.05, 0.45
    shares = np.sort(np.log(found / low) / np.log(high / low))
    # A Sobol sequence of 64 has one point in each of 64 equal parts of every axis.
    assert np.array_equal(np.floor(shares * 64), np.arange(64))


@pytest.mark.usefixtures("cheap")
def test_rows_of_one_place_share_the_anemometers_gain() -> None:
    """Three winds of one place show the weight no better than the gain allows: to 6 %; of three
    places, to 6 %/√3. What numerics may add is the same in all."""
    winds = (4.0, 6.0, 9.0)
    apart = [
        _observed(0.17, speed=np.full(190, wind), seed=number) for number, wind in enumerate(winds)
    ]
    together = [replace(one, place="tunnel") for one in apart]
    shared = _found(*together)
    assert _spread(shared) / 0.17 == pytest.approx(_sigma(1), rel=0.2)
    assert _spread(_found(*apart)) / 0.17 == pytest.approx(_sigma(3), rel=0.2)
    assert len({one.place["gain"].value for one in shared.recordings}) == 1
    assert "constant-wind" not in {finding.kind for finding in shared.findings}


def test_ten_seconds_are_enough_beside_ten_others_and_not_alone() -> None:
    """As three winds of a tunnel, each filmed for ten seconds."""
    short = [
        replace(one, readings=one.readings[:4])
        for one in (_observed(0.17), _observed(0.17, seed=10))
    ]
    assert [design.duration for design in designs_of(short, _OPTIONS)] == [10.0, 10.0]
    with pytest.raises(InputError, match="10 s of film have a log"):
        designs_of(short[:1], _OPTIONS)


def test_pixels_err_by_the_film_and_by_the_window() -> None:
    # Errors of windows of variance (1 − L) σ², of the film of L σ²:
    # Var a = σ² (L + (1 − L)/n), Var b = (1 − L) σ²/Σ(x − x̄)².
    film = replace(_observed(0.2), sigma=np.full(len(OBSERVED), 0.03))
    drawn = film.pixels(4000, seed=1) / 0.03
    relative = np.log(film.speed) - np.log(film.speed).mean()
    passing = 1 - observed.LASTING
    wanted = [observed.LASTING + passing / 48, passing / np.square(relative).sum()]
    assert np.square(drawn).mean(axis=0) == pytest.approx(np.array(wanted), rel=0.08)
    of_pair = np.corrcoef(
        drawn[:, 0, OBSERVED.index("extension")], drawn[:, 0, OBSERVED.index("area")]
    )[0, 1]
    assert of_pair == pytest.approx(0.77, abs=0.02)
    assert (_observed(0.2).pixels(3, seed=1) == 0).all()


@pytest.mark.parametrize("name", ["frequency", "area"])
def test_two_films_of_a_flag_err_alike_as_far_as_its_look_goes(name: str) -> None:
    """Films of two minutes, each with what is its own of what lasts in it, and with what passes."""
    place = OBSERVED.index(name)
    one, other = (
        replace(_observed(0.2), sigma=np.full(len(OBSERVED), 0.03), name=name)
        for name in ("a", "b")
    )
    both = [film.pixels(4000, seed=1)[:, 0, place] for film in (one, other)]
    lasting = observed.LASTING[place]
    wanted = observed.COMMON * lasting / (lasting + (1 - lasting) / 48)
    assert np.corrcoef(both[0], both[1])[0, 1] == pytest.approx(
        wanted, abs=0.05
    )  # three standard errors of 4,000 draws


def test_the_shares_are_those_of_films_by_another_renderer() -> None:
    """The table is what the sheet has; a share that was made up would differ from it."""
    results = Path(__file__).resolve().parents[4] / "docs" / "results"
    sheet = json.loads((results / "validate-observables.json").read_text(encoding="utf-8"))
    found = share(vtk(sheet["result"]["films"]))
    assert found == pytest.approx(observed.LASTING, abs=0.006)


def test_draws_windows_and_readings_are_a_data_set(plain: Calibration) -> None:
    pytest.importorskip("xarray")
    found = answer_of_calibration(plain).to_xarray()
    assert found["area_weight_draws"].attrs["units"] == "kg/m²"
    assert float(found["area_weight_draws"].median()) == pytest.approx(plain.weight.value)
    droop = found["reading"].sel(observable="droop")
    assert dict(droop.sizes) == {"recording": 1, "window": 48}
    np.testing.assert_array_equal(droop[0], plain.recordings[0].observed.readings[:, 0])
    assert str(droop["observable_unit"].item()) == "rad"
    assert float(found["wind_speed"].mean()) == pytest.approx(plain.recordings[0].wind_speed)
