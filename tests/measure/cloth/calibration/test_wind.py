"""The wind that blew, of what was logged."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from flagdata.core.rng import stream
from flagdata.errors import InputError
from measure.cloth import Log
from measure.cloth.blown_wind import WIND_RATE, blown
from sim.effects import AnemometerLag
from sim.wind import VonKarman

_MEAN, _DISTANCE = 6.0, 3.0


def _turbulent(duration: float = 190.0) -> tuple[np.ndarray, np.ndarray]:
    rng = stream(3, "tests", "turbulence")
    speed = VonKarman(mean=_MEAN, intensity=0.2, length=60.0).series(
        rng, duration=duration, rate=WIND_RATE
    )
    return np.arange(len(speed)) / WIND_RATE - 60.0, speed


def _logged(times: np.ndarray, speed: np.ndarray, at: np.ndarray) -> np.ndarray:
    lag = AnemometerLag(distance=_DISTANCE).read(
        torch.from_numpy(times), torch.from_numpy(speed[:, None])
    )
    return np.interp(at, times, lag.numpy()[:, 0])


def test_what_is_filled_in_would_be_logged_as_the_log() -> None:
    times, speed = _turbulent()
    at = np.arange(-60.0, 121.0)
    log = Log(times=at, speed=_logged(times, speed, at))
    made = blown(log, before=4.0, duration=100.0, distance=_DISTANCE, eddies=60.0, seed=5)
    again = _logged(
        np.arange(len(made)) / WIND_RATE - 4.0, np.hypot(made[:, 0], made[:, 1]), at[66:150]
    )
    # What the slope over two seconds and the line between samples leave is an eighth of the log's
    # own changes.
    assert np.std(again - log.speed[66:150]) < 0.15 * log.speed.std()
    assert abs(np.mean(again - log.speed[66:150])) < 0.02


def test_turbulence_above_the_logs_rate_has_the_spectrums_energy() -> None:
    times, speed = _turbulent()
    at = np.arange(-60.0, 121.0)
    log = Log(times=at, speed=_logged(times, speed, at))

    def fast(series: np.ndarray) -> float:
        return float(np.square(np.diff(series)).mean())

    made = [
        blown(log, before=4.0, duration=100.0, distance=_DISTANCE, eddies=60.0, seed=k)[:, 0]
        for k in range(8)
    ]
    # Differences of 0.1 s: of a log between whose samples lines are drawn they are a twentieth of
    # this.
    assert np.mean([fast(one) for one in made]) == pytest.approx(fast(speed), rel=0.35)
    assert fast(np.interp(times, at, log.speed)) < 0.2 * fast(speed)
    assert not np.allclose(made[0], made[1])


def test_a_logged_direction_is_followed() -> None:
    at = np.arange(-60.0, 61.0)
    turn = 0.3 * np.sin(2 * np.pi * at / 40)
    log = Log(times=at, speed=np.full(len(at), 5.0), turn=turn, distance=0.0)
    made = blown(log, before=4.0, duration=50.0, distance=0.0, eddies=60.0, seed=1)
    seen = np.arctan2(made[:, 1], made[:, 0])
    assert (
        np.corrcoef(seen, np.interp(np.arange(len(made)) / WIND_RATE - 4.0, at, turn))[0, 1] > 0.99
    )


def test_a_log_that_does_not_cover_the_film_is_refused() -> None:
    log = Log(times=np.arange(0.0, 50.0), speed=np.full(50, 5.0))
    with pytest.raises(InputError, match=r"from 0\.0 to 49\.0 s .* from 0\.0 to 120\.0 s"):
        log.cut(0.0, 120.0)
    with pytest.raises(InputError, match="does not cover"):
        log.cut(-30.0, 20.0)


def test_a_gap_beside_the_film_is_refused_and_one_elsewhere_is_not() -> None:
    times = np.concatenate([np.arange(0.0, 100.0), np.arange(120.0, 300.0)])
    log = Log(times=times, speed=np.full(len(times), 5.0))
    with pytest.raises(InputError, match=r"gap of 21\.0 s"):
        log.cut(80.0, 140.0)
    assert log.cut(190.0, 280.0).times[0] == pytest.approx(-60.0)


@pytest.mark.parametrize("speed", [np.zeros(9), np.full(9, np.nan)])
def test_no_wind_is_refused(speed: np.ndarray) -> None:
    with pytest.raises(InputError, match="no wind"):
        Log(times=np.arange(9.0), speed=speed)
