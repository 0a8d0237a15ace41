"""A flag's law and an anemometer's faults, found together from a table and a log that were made of
them."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.clock_model import NINETY
from flagdata.core.rng import stream
from flagdata.core.stated import parse
from flagdata.errors import InputError
from sim.effects import SENSOR_EFFECTS, AnemometerEffect
from tests.studies.instruments.chain import ORDER, Chain, about
from tests.studies.instruments.disagreement import (
    Disagreement,
    Law,
    Readings,
    Rows,
    fit,
    jackknife,
    without,
)

SPAN = 1.0
OFFSET, THRESHOLD, LATE = -0.3, 0.9, 0.35
SCALE, EXPONENT, REST = 3.0, 0.7, 0.2
EFFECTS = ("clock-offset", "anemometer-dead-zone", "anemometer-offset")


def _made() -> tuple[Rows, Readings]:
    """Ninety seconds of a wind of 0 to 6 m/s; a log at 50 Hz with a zero of -0.3 m/s, nothing below
    0.9 m/s, its clock 0.35 s ahead; and rows of a second, every quarter of one, of y = √(0.2² +
    (u/3)^(2/0.7)) with 2 % of noise."""
    times = np.arange(0.0, 90.0, 0.02)
    wind = np.maximum(3.0 + 3.0 * np.sin(times / 4.1) * np.cos(times / 9.0), 0.0)
    reading = np.where(wind < THRESHOLD, 0.0, wind) + OFFSET
    at = np.arange(2.0, 88.0, 0.25)
    mean = Readings(times=times, speed=wind).means(at, SPAN)
    noise = 1 + 0.02 * stream(3, "tests", "instruments").standard_normal(len(at))
    values = np.sqrt(REST**2 + (mean / SCALE) ** (2 / EXPONENT)) * noise
    return Rows(times=at, span=SPAN, values=values, rest=REST), Readings(
        times=times + LATE, speed=reading
    )


@pytest.fixture(scope="module")
def found() -> Disagreement:
    rows, log = _made()
    return fit(rows, log, EFFECTS, seed=1)


def test_the_faults_that_were_put_in_come_out_with_their_uncertainties(found: Disagreement) -> None:
    rows, log = _made()
    blocks = (rows.times // 16.0).astype(np.int64)
    sigmas, errors = jackknife(rows, log, EFFECTS, found, blocks=blocks)
    truth = {"clock-offset": LATE, "anemometer-dead-zone": THRESHOLD, "anemometer-offset": OFFSET}
    for name, tolerance in (
        ("clock-offset", 0.05),
        ("anemometer-dead-zone", 0.2),
        ("anemometer-offset", 0.06),
    ):
        assert found.chain.strengths[name] == pytest.approx(truth[name], abs=tolerance)
        assert 0 < sigmas[name] < tolerance * 2
    assert found.law.wind(np.ones(1))[0] == pytest.approx(SCALE, rel=0.05)
    assert found.law.exponent == pytest.approx(EXPONENT, rel=0.1)
    # 2 % of noise of y is 1.4 % of the wind, 0.04 m/s of 3; a threshold within a row's second is
    # not resolved.
    assert float(np.sqrt(np.mean(np.square(errors)))) < 0.15
    inside = np.abs(errors) <= NINETY * found.deviation(rows)
    assert 0.8 < float(inside.mean()) < 0.99
    worse = without(found, "anemometer-offset").errors(rows, log)
    assert float(np.mean(worse - found.errors(rows, log))) == pytest.approx(-OFFSET, abs=0.06)


def test_a_prior_of_the_clock_fixes_it(found: Disagreement) -> None:
    rows, log = _made()
    held = fit(rows, log, EFFECTS, known={"clock-offset": parse("0.25±0.0001")}, near=found)
    assert held.chain.clock == pytest.approx(0.25, abs=0.001)
    with pytest.raises(InputError, match="clock-offset without a deviation"):
        fit(rows, log, EFFECTS, known={"clock-offset": parse("0.35")})


def test_only_rows_that_are_used_are_fitted(found: Disagreement) -> None:
    rows, log = _made()
    use = rows.times < 40.0  # a clock is sought within 5 s
    broken = Readings(times=log.times, speed=np.where(log.times > 52.0, 100.0, log.speed))
    assert fit(rows, broken, EFFECTS, use=use, near=found) == fit(
        rows, log, EFFECTS, use=use, near=found
    )
    with pytest.raises(InputError, match="0 rows with a log beside them"):
        fit(rows, log, EFFECTS, use=rows.times > 1000.0)


def test_effects_that_are_absent_leave_the_wind_as_it_is() -> None:
    rows, _ = _made()
    nothing = Disagreement(law=Law(scale=SCALE, exponent=EXPONENT), chain=Chain(strengths={}))
    wind = nothing.law.wind(rows.excess)
    assert np.array_equal(nothing.chain.read(rows.times, wind), wind)
    nulls = Chain(strengths={name: about(name).null for name in ORDER})
    assert np.array_equal(nulls.read(rows.times, wind), wind)
    with pytest.raises(InputError, match="frame-jitter acts on no reading"):
        Chain(strengths={"frame-jitter": 0.1})


def test_the_chain_has_every_anemometers_effect_of_one_strength() -> None:
    kinds = {name: SENSOR_EFFECTS[name] for name in SENSOR_EFFECTS}
    own = {
        n
        for n, kind in kinds.items()
        if issubclass(kind, AnemometerEffect) and len(kind.strengths()) == 1
    }
    assert own - {"sensor-height", "sensor-distance"} == set(ORDER)
