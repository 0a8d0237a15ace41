"""Descriptions and checks of parameters."""

from __future__ import annotations

import pytest
import torch

from flagdata.core.rng import stream
from flagdata.errors import InputError, UnknownNameError, UsageError
from sim.effects import EFFECTS, Parameter, Porosity, Role, Shear, apply
from tests.sim.conftest import PLAIN, make_system


def test_a_refused_value_is_reported_with_its_admissible_range_and_expected_value() -> None:
    with pytest.raises(InputError) as caught:
        Porosity(open_share=torch.tensor([0.1, 1.5]))
    assert caught.value.where == "Porosity.open_share"
    assert caught.value.what == "0.1 to 1.5 is not admissible"
    assert caught.value.fix == "give a value from 0 to 1; expected are 0 to 0.3"


@pytest.mark.parametrize(
    ("prior", "null", "weighed", "step"),
    [
        ((0.0, 0.5), 0.0, (0.025, 0.5), 0.05),
        ((1.2, 3.0), 1.0, (0.2, 2.0), 0.2),
        ((-0.4, 0.1), 0.0, (-0.4, 0.1), -0.04),
        ((-2.0, 0.0), 0.0, (-2.0, -0.1), -0.2),
    ],
)
def test_an_effect_that_states_no_strengths_is_weighed_by_those_of_its_prior(
    prior: tuple[float, float], null: float, weighed: tuple[float, float], step: float
) -> None:
    """One sign: the least is a twentieth of the most. Steps are a tenth, toward the farther end."""
    described = Parameter(
        role=Role.STRENGTH, unit="1", prior=prior, admissible=(-9.0, 9.0), source="", null=null
    )
    assert described.weighed_range == pytest.approx(weighed)
    assert described.small_step == pytest.approx(step)


def test_a_mistyped_effect_is_answered_with_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'porosity'"):
        EFFECTS["porostiy"]


def test_an_effect_at_null_leaves_the_system_itself(square) -> None:
    system, state = make_system(square, [PLAIN])
    assert apply([Porosity(), Shear(exponent=0.0, height=3.0)], system, state) == (system, state)


def test_a_wanted_gradient_keeps_an_effect_at_null(square) -> None:
    system, state = make_system(square, [PLAIN])
    wanted = torch.zeros(1, dtype=torch.float64, requires_grad=True)
    changed, _ = apply([Porosity(open_share=wanted)], system, state)
    assert changed is not system
    assert any(tensor.requires_grad for tensor in changed.tensors())


def test_values_for_another_batch_are_refused(square) -> None:
    system, state = make_system(square, [PLAIN, PLAIN])
    with pytest.raises(UsageError, match="2 members, and there are values for 3"):
        apply([Porosity(open_share=torch.full((3,), 0.1))], system, state)


def test_draws_lie_in_the_prior_and_repeat() -> None:
    draws = [Shear.drawn(stream(1, "shear"), batch=200) for _ in range(2)]
    for label, parameter in Shear.parameters().items():
        one, two = (getattr(draw, label) for draw in draws)
        assert torch.equal(one, two)
        low, high = parameter.prior
        assert low <= float(one.min()) < float(one.max()) <= high
        # The mean of 200 uniform draws: (high − low)/√(12·200) is 2 % of the range; 4 σ allowed.
        assert float(one.mean()) == pytest.approx((low + high) / 2, abs=0.082 * (high - low))
