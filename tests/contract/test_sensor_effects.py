"""What every sensor effect must hold to: parametrised over the table, so that an entry there enrols
it here."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor

from flagdata.core.rng import stream
from flagdata.errors import InputError
from sim.effects import SENSOR_EFFECTS, AnemometerEffect, Parametrised, Sampling
from sim.effects.sensor import CameraEffect, ClockEffect
from tests.contract.strengths import nulled

NAMES = list(SENSOR_EFFECTS)
BATCH = 2
JUMPS = {
    "anemometer-dead-zone": "a reading jumps at the threshold: no gradient there (its docstring "
    "says so)"
}


def drawn(name: str, *path: str) -> Parametrised:
    return SENSOR_EFFECTS[name].drawn(stream(6, name, *path), batch=BATCH)


TIME = torch.arange(0.0, 12.0, 0.05, dtype=torch.float64)
STAMPS = torch.arange(2.0, 8.0, 0.04, dtype=torch.float64)
ROWS = torch.tensor([0.1, 0.8], dtype=torch.float64)
SPEED = (4 + 3.9 * torch.sin(2.1 * TIME) + torch.cos(0.3 * TIME))[:, None] * torch.tensor(
    [1.0, 0.6]
)
ANGLE = 3 * TIME[:, None, None, None] + torch.arange(12.0, dtype=torch.float64).reshape(2, 3, BATCH)
TRAJECTORY = torch.sin(ANGLE) + 0.3 * torch.cos(2.2 * ANGLE)


def observed(effect: Parametrised, *, shift: float = 0.0) -> Tensor:
    """What an effect makes of an observation: (…, batch). `shift` moves everything in time [s]."""
    match effect:
        case AnemometerEffect():
            return effect.read(TIME + shift, SPEED)
        case ClockEffect():
            return effect.stamps((TIME + shift)[:, None].expand(-1, BATCH)) - shift
        case CameraEffect():
            return effect.change_instants(Sampling.ideal(STAMPS + shift, ROWS)).observe(
                TIME + shift, TRAJECTORY
            )
    raise AssertionError(effect)


def untouched(effect: Parametrised) -> Tensor:
    """The same observation without the effect."""
    match effect:
        case AnemometerEffect():
            return SPEED
        case ClockEffect():
            return TIME[:, None].expand(-1, BATCH)
        case CameraEffect():
            return Sampling.ideal(STAMPS, ROWS).observe(TIME, TRAJECTORY)
    raise AssertionError(effect)


@pytest.mark.parametrize("name", NAMES)
def test_at_its_null_value_the_observation_is_untouched_to_the_bit(name: str) -> None:
    effect = nulled(drawn(name))
    assert effect.absent
    assert torch.equal(observed(effect), untouched(effect))


@pytest.mark.parametrize("name", NAMES)
def test_away_from_its_null_value_it_changes_the_observation(name: str) -> None:
    effect = drawn(name)
    change = (observed(effect) - untouched(effect)).abs().reshape(-1, BATCH).amax(0)
    # The smallest draw of any prior is a jitter or drift of some 1e-5 s.
    assert (change > 1e-6).all()


@pytest.mark.parametrize("name", NAMES)
def test_it_does_not_matter_when_the_record_began(name: str) -> None:
    # Times near 1e4 s are held to 2e-12 s; the motion's speed and the lag's rate keep it at that.
    torch.testing.assert_close(
        observed(drawn(name), shift=1e4), observed(drawn(name)), rtol=0, atol=1e-9
    )


@pytest.mark.parametrize("name", NAMES)
def test_a_member_does_not_feel_the_values_of_another(name: str) -> None:
    effect, different = drawn(name), drawn(name, "other")
    labels = [*effect.parameters()]
    mixed = {
        label: torch.stack([getattr(effect, label)[0], getattr(different, label)[1]])
        for label in labels
    }
    first, second = observed(effect), observed(replace(effect, **mixed))
    assert torch.equal(first[..., 0], second[..., 0])
    assert not torch.equal(first[..., 1], second[..., 1])


@pytest.mark.parametrize("name", NAMES)
def test_one_number_is_the_same_as_that_number_for_each_member(name: str) -> None:
    effect = drawn(name)
    values = {label: float(getattr(effect, label)[0]) for label in effect.parameters()}
    each = {
        label: torch.full((BATCH,), value, dtype=torch.float64) for label, value in values.items()
    }
    torch.testing.assert_close(
        observed(replace(effect, **values)), observed(replace(effect, **each)), rtol=0, atol=1e-13
    )


@pytest.mark.parametrize("name", NAMES)
def test_gradients_are_those_of_differences(name: str) -> None:
    if name in JUMPS:
        assert "no gradient" in SENSOR_EFFECTS[name].__doc__
        return
    effect = drawn(name, "gradient")
    labels = list(effect.parameters())
    weight = torch.cos(torch.arange(observed(effect).numel(), dtype=torch.float64)).reshape(
        observed(effect).shape
    )
    values = [getattr(effect, label).clone().requires_grad_() for label in labels]
    # A camera's motion is linear between samples: a step must not carry an instant over one.
    widths = [p.prior[1] - p.prior[0] for p in effect.parameters().values()]

    def run(*inputs: Tensor) -> Tensor:
        return (weight * observed(replace(effect, **dict(zip(labels, inputs, strict=True))))).sum()

    gradients = torch.autograd.grad(run(*values), values)
    for index, (gradient, width) in enumerate(zip(gradients, widths, strict=True)):
        for member in range(BATCH):
            step = torch.zeros(BATCH, dtype=torch.float64)
            step[member] = 1e-7 * width
            with torch.no_grad():
                above, below = (
                    [v + s * step if i == index else v for i, v in enumerate(values)]
                    for s in (1, -1)
                )
                difference = float(run(*above) - run(*below)) / (2e-7 * width)
            # Rounding of a sum of some hundred values of order 5, over the step.
            assert float(gradient[member]) == pytest.approx(
                difference, rel=1e-4, abs=1e-13 / (1e-7 * width) * 10
            )


@pytest.mark.parametrize("name", NAMES)
def test_values_that_make_no_sense_are_refused_by_name(name: str) -> None:
    effect = drawn(name)
    for label, parameter in effect.parameters().items():
        with pytest.raises(InputError, match=label):
            replace(effect, **{label: float("inf")})
        if np.isfinite(parameter.admissible[0]):
            with pytest.raises(InputError, match=label):
                replace(effect, **{label: parameter.admissible[0] - 1.0})


@pytest.mark.parametrize("name", NAMES)
def test_it_travels_between_processes(name: str) -> None:
    effect = drawn(name)
    assert torch.equal(observed(pickle.loads(pickle.dumps(effect))), observed(effect))
