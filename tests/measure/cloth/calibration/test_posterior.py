"""The cloth of several recordings whose residuals are correlated."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.errors import InputError
from measure.cloth import (
    AZIMUTH,
    ELEVATION,
    OBSERVED,
    CalibrationOptions,
    Design,
    Emulator,
    Flag,
    Log,
    Observed,
    Sight,
    cloth_posterior,
    designs_of,
    weigh_cloths,
)
from measure.cloth.emulator import scatter

_FLAG = Flag(length=1.5, height=1.0)
_LOG = Log(times=np.arange(-10.0, 61.0), speed=np.full(71, 5.0))
_COMMON, _OWN = 0.3, 0.1
_FLAGS, _RECORDINGS = 128, 4


def _designs(seed: int) -> list[Design]:
    return [
        Design(
            flag=_FLAG,
            log=_LOG,
            duration=60.0,
            count=_FLAGS,
            seed=seed,
            recording=f"{k}",
            place=f"{k}",
        )
        for k in range(_RECORDINGS)
    ]


def _shown(seed: int) -> tuple[FloatArray, list[FloatArray]]:
    """Weights (flag,), and what each recording shows of these (flag, 1): the weight's logarithm,
    with an error that all recordings of a flag have in common and one of its own."""
    rng = stream(seed, "tests", "shown")
    (first, *_) = [design.values()["area_weight"] for design in _designs(seed)]
    common = _COMMON * rng.standard_normal((_FLAGS, 1))
    own = _OWN * rng.standard_normal((_RECORDINGS, _FLAGS, 1))
    return first, [np.log(first)[:, None] + common + one for one in own]


def _sights(seed: int) -> list[Sight]:
    _, shown = _shown(seed)
    return [
        Sight(
            emulator=Emulator.fit(
                design.values(), own, np.ones(1, dtype=np.bool_), name=design.recording
            ),
            azimuth=AZIMUTH,
            elevation=ELEVATION,
            place=design.place,
        )
        for design, own in zip(_designs(seed), shown, strict=True)
    ]


def test_what_recordings_have_in_common_does_not_average_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Recordings that were independent would know the weight to 0.3/√4; what is common leaves
    √(0.3² + 0.1²/4)."""
    monkeypatch.setattr(cloth_posterior, "CHECK", (64, 200))
    sights = _sights(1)
    weights, shown = _shown(2)
    inner = (weights > 0.1) & (weights < 0.22)  # the prior's ends do not cut their posteriors
    drawn = np.log(weigh_cloths(sights, [own[inner] for own in shown], seed=3)["area_weight"])
    assert np.median(drawn.std(axis=1)) == pytest.approx(np.hypot(_COMMON, _OWN / 2), rel=0.15)
    low, high = np.quantile(drawn, [0.05, 0.95], axis=1)
    held = ((low <= np.log(weights[inner])) & (np.log(weights[inner]) <= high)).mean()
    assert (
        0.8 <= held <= 0.98
    )  # of some 46 flags, each in its interval of 90 %: two standard errors


def test_the_scatter_of_several_recordings_is_the_predictive_one_of_all_their_summaries() -> None:
    emulators = [one.emulator for one in _sights(1)]
    found = scatter(emulators)
    assert found.together
    scale = np.linalg.inv(found.white.T @ found.white)
    covariance = scale * found.freedom / (found.freedom - 2)
    expected = _COMMON**2 + _OWN**2 * np.eye(_RECORDINGS)
    # Of 128 simulations with 11 regressors and 4 summaries the residuals' covariance is known to 13
    # %.
    np.testing.assert_allclose(covariance, expected, rtol=0.35)
    residuals = np.concatenate([one.residuals for one in emulators], axis=1)
    np.testing.assert_allclose(covariance, residuals.T @ residuals / (128 - 11 - 4 - 1), rtol=1e-9)


def test_recordings_of_other_cloths_are_taken_apart() -> None:
    assert not scatter([_sights(1)[0].emulator, _sights(2)[1].emulator]).together


def test_a_recording_that_is_given_twice_is_refused() -> None:
    readings = np.zeros((24, len(OBSERVED)))
    one = Observed(name="one", source="x", readings=readings, log=_LOG)
    other = Observed(name="other", source="x", readings=readings, log=_LOG)
    first, second = designs_of([one, other], CalibrationOptions(flag=_FLAG))
    assert first.recording != second.recording
    with pytest.raises(InputError, match="one is given twice"):
        designs_of([one, other, one], CalibrationOptions(flag=_FLAG))
