"""Models whose cloth does not stay one are drawn back to the nominal model, which ran."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest
import torch

from measure.forecasting import THETA, Calibration, EffectColumn, Forecaster, Model, Segments
from measure.inference import NullModel, WhitenedMisfit
from measure.loop import gauss_newton
from measure.probes import Statistics

LIFT = EffectColumn(effect="lift", parameter="coefficient", step=0.3)
FAR = Model(
    calibration=Calibration(area_weight=0.5, bending=4.0, damping=10e-3), effects=((LIFT, 2.0),)
)
NOTHING = cast(Forecaster, None), cast(Segments, None)


def linearised(_: Forecaster, __: Segments, model: Model) -> Statistics:
    """Of models that run from 70 % of the nominal area weight on; the data are the model."""
    count, size = len(THETA) + len(model.effects), 4
    r = np.full((size, count), np.nan if model.calibration.area_weight < 0.7 else 0.0)
    return Statistics(
        recording=np.zeros(size, dtype=np.int64),
        r=r,
        response=np.tile(10 * np.eye(count), (size, 1, 1)),
        error=np.ones(size),
        marker_error=np.ones((size, 1)),
    )


def null(count: int) -> NullModel:
    return NullModel(
        coefficients=np.zeros((3, count)), covariance=np.eye(count), shifts=np.zeros((0, count))
    )


def test_halfway_is_halfway_in_the_units_of_the_parameters() -> None:
    half = FAR.halfway_to_nominal()
    np.testing.assert_allclose(
        np.array(half.calibration.steps_from(Calibration())),
        np.array(FAR.calibration.steps_from(Calibration())) / 2,
    )
    assert half.effects == ((LIFT, 1.0),)


@pytest.mark.parametrize("effects", [(), FAR.effects])
def test_a_model_that_diverges_is_drawn_back(
    monkeypatch: pytest.MonkeyPatch, effects: tuple[tuple[EffectColumn, float], ...]
) -> None:
    monkeypatch.setattr(gauss_newton, "_linearise_models", linearised)
    model = Model(calibration=FAR.calibration, effects=effects)
    found = gauss_newton._round(  # pyright: ignore[reportPrivateUsage]
        *NOTHING,
        model,
        null(len(THETA) + len(effects)),
        np.full(4, 5.0),
        (5,) * len(effects),
        anchor=Calibration(),
    )
    assert found.origin.calibration.area_weight == pytest.approx(0.5**0.5)
    assert [strength for _, strength in found.origin.effects] == [
        strength / 2 for _, strength in effects
    ]


def test_a_model_that_always_diverges_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    lost = linearised(*NOTHING, Model(calibration=FAR.calibration))
    monkeypatch.setattr(gauss_newton, "_linearise_models", lambda *_: lost)
    with pytest.raises(gauss_newton.FitDivergedError, match="does not stay one"):
        gauss_newton._round(  # pyright: ignore[reportPrivateUsage]
            *NOTHING,
            Model(calibration=FAR.calibration),
            null(len(THETA)),
            np.full(4, 5.0),
            (),
            anchor=Calibration(),
        )


@pytest.mark.parametrize(
    ("bending", "steps"), [(1.0, (0.7, 0.3)), (50.0, (-0.7, 0.3)), (35.0, (-0.7, 0.3))]
)
def test_sensitivities_at_a_bound_are_taken_from_within(
    bending: float, steps: tuple[float, float]
) -> None:
    """The bending's factor is at most 50, its step a factor of e^0.7 = 2."""
    model = Model(calibration=Calibration(bending=bending), effects=((LIFT, 1.0),))
    for place, step in ((1, steps[0]), (3, steps[1])):
        size = abs(step)
        moved, taken = model.take_step(place, size)
        assert taken == pytest.approx(step)
        np.testing.assert_allclose(
            moved.steps_from(model), np.where(np.arange(4) == place, step, 0.0), atol=1e-12
        )


def test_a_fit_begins_where_across_the_prior_least_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Springs along the hoist soon saturate: the linear fit promises 23 N/m² where 17,000 act."""
    hoist = EffectColumn(effect="full-hoist", parameter="stiffness", step=20.0)

    class Whitened:
        def of(self, errors: torch.Tensor) -> Whitened:
            self.remainder = abs(np.log(float(errors) / 17_000))
            return self

        def fit(self, chosen: tuple[int, ...]) -> Whitened:
            return self

    def errors_of(models: list[Model], *_: object) -> list[torch.Tensor]:
        strengths = [model.effects[0][1] for model in models]
        return [torch.tensor(value if value < 15_000 else float("inf")) for value in strengths]

    monkeypatch.setattr(gauss_newton, "errors_of", errors_of)

    def begun(linear: float) -> float:
        model = Model(calibration=Calibration(), effects=((hoist, linear),))
        found = gauss_newton._where_least_is_left(  # pyright: ignore[reportPrivateUsage]
            *NOTHING, cast(WhitenedMisfit, Whitened()), model
        )
        return found.effects[0][1]

    # 100 to 20,000 N/m² in equal factors of 5.85, the last of which diverges here.
    assert begun(23.0) == pytest.approx(20_000 / 200 ** (1 / 3))
    assert begun(9_000.0) == 9_000.0


def test_strengths_of_a_prior_of_both_signs_are_tried_on_either_side() -> None:
    turned = EffectColumn(effect="direction-change", parameter="angle", step=0.05)
    assert gauss_newton._expected_strengths(turned) == [-0.4, -0.8, 0.4, 0.8]  # pyright: ignore[reportPrivateUsage]
