"""Targets: ranges, bending summaries by hand, and logits that come back."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from flagdata.errors import InputError, UnknownNameError
from flagdata.recipes.typed_tables import ends
from models.networks.targets import TARGETS, Cloth, Scaling, truth

NAMES = ("wind_speed", "area_weight", "bending_scale", "anisotropy")


def test_bending_is_summed_up_by_its_mean_logarithm_and_by_warp_over_weft() -> None:
    """Warp (first five) 10⁻³, between 10⁻⁴, weft (last five) 10⁻⁵: mean −4, ratio 2 decades."""
    bending = np.repeat([1e-3, 1e-4, 1e-5], 5)
    parameters = {f"bending.{index}": np.array([value]) for index, value in enumerate(bending)}
    parameters |= {"wind_speed": np.array([3.0]), "area_weight": np.array([0.12])}
    assert truth(parameters, NAMES)[0] == pytest.approx([3.0, 0.12, -4.0, 2.0])


def test_logits_come_back_within_the_range_and_at_its_ends() -> None:
    values = torch.tensor(
        [[0.0, 0.10, -4.6, -1.8], [10.0, 0.17, -3.25, 1.8], [5.0, 0.135, -3.925, 0.0]]
    )
    scaling = Scaling(names=NAMES)
    assert scaling.learned(values).isfinite().all()
    torch.testing.assert_close(
        scaling.values(scaling.learned(values)), values, rtol=1e-4, atol=1e-4
    )
    middle = scaling.learned(values)[2]
    torch.testing.assert_close(middle, torch.zeros(4), rtol=0, atol=1e-5)


def test_no_logit_gives_a_value_beyond_the_widened_range() -> None:
    values = Scaling(names=("wind_speed",)).values(torch.tensor([[-50.0], [50.0]]))
    assert values[:, 0].tolist() == pytest.approx([-0.05, 10.05])


def test_the_spread_of_a_prior_is_that_of_a_uniform_one() -> None:
    assert Scaling(names=("wind_speed",)).spread[0] == pytest.approx(np.sqrt(100 / 12))


def test_unknown_targets_are_named_with_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="wind_sped"):
        Scaling(names=("wind_sped",))


def test_clips_that_do_not_state_a_parameter_are_an_error_that_names_it() -> None:
    with pytest.raises(InputError, match=r"bending\.0"):
        truth({"wind_speed": np.array([1.0])}, ("anisotropy",))


def test_the_papers_ranges_are_the_papers() -> None:
    assert (TARGETS["wind_speed"].low, TARGETS["wind_speed"].high) == (0.0, 10.0)
    assert (TARGETS["area_weight"].low, TARGETS["area_weight"].high) == (0.10, 0.17)


CLOTH = ("cloth_wind", "cloth_area_weight", "cloth_bending")


def test_a_quantity_has_one_name_whatever_cloth_it_is_of() -> None:
    hanging = Scaling(names=CLOTH)
    assert hanging.quantities == Scaling(names=NAMES[:3]).quantities == NAMES[:3]
    assert {target.cloth for target in hanging.targets} == {Cloth.HANGING}
    assert [target.unit for target in hanging.targets] == [TARGETS[name].unit for name in NAMES[:3]]


def test_the_truth_of_hanging_cloth_is_read_from_the_same_parameters() -> None:
    parameters = {f"bending.{index}": np.array([1e-4]) for index in range(15)}
    parameters |= {"wind_speed": np.array([3.0]), "area_weight": np.array([0.3])}
    assert truth(parameters, CLOTH)[0] == pytest.approx([3.0, 0.3, -4.0])


def test_no_weight_of_hanging_cloth_is_cut_to_the_range_of_flags() -> None:
    scaling = Scaling(names=("cloth_area_weight",))
    values = torch.tensor([[0.08], [0.30], [0.45]])
    torch.testing.assert_close(
        scaling.values(scaling.learned(values)), values, rtol=1e-4, atol=1e-5
    )


@pytest.mark.parametrize(
    "names", [("wind_speed", "cloth_area_weight"), ("area_weight", "area_weight")]
)
def test_targets_of_two_kinds_of_cloth_or_named_twice_are_refused(names: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match=names[1]):
        Scaling(names=names)


def test_the_ranges_of_hanging_cloth_hold_all_that_its_scene_can_draw() -> None:
    """Ends of the factors times the tables of the ten materials, in log10 for the 15 bending
    coefficients."""
    from sim.run import load

    scene = load("hanging-cloth-wide")
    spec = scene.material
    area_weight = [
        base.area_weight * factor for base in spec.bases for factor in ends(spec.area_weight_factor)
    ]
    own = [float(np.log10(base.bending).mean()) for base in spec.bases]
    bending = [scale + math.log10(factor) for scale in own for factor in ends(spec.bending)]
    for name, drawn in (
        ("cloth_wind", ends(scene.wind.speed)),
        ("cloth_area_weight", area_weight),
        ("cloth_bending", bending),
    ):
        target = TARGETS[name]
        assert target.low <= min(drawn)
        assert max(drawn) <= target.high
        assert (max(drawn) - min(drawn)) / (
            target.high - target.low
        ) > 0.9  # and hardly more than that


def test_values_beyond_a_range_are_counted_with_how_far_they_reach() -> None:
    """Those within the range, or within the 0.5 % that it is widened by at each end, are learned as
    they are."""
    values = np.array([[0.0, 0.12], [10.04, 0.17], [10.06, 0.13], [15.9, np.nan]])
    (said,) = Scaling(names=("wind_speed", "area_weight")).beyond(values)
    assert (
        said
        == "2 of 4 clips lie beyond the range of the target wind_speed, 0 to 10 m/s: they reach "
        "from 0 to 15.9"
    )
    Scaling(names=("wind_speed", "area_weight")).check(values[:2], where="here")


def test_a_target_of_the_same_cloth_whose_range_is_wide_enough_is_offered() -> None:
    heavy = np.array([[0.2], [0.3]])
    with pytest.raises(
        InputError, match=r"0\.1 to 0\.17 kg/m²: they reach from 0\.2 to 0\.3"
    ) as caught:
        Scaling(names=("area_weight",)).check(heavy, where="the training side")
    assert caught.value.where == "the training side"
    assert caught.value.fix.startswith(
        "name the target fabric_area_weight or world_area_weight in [loss] targets"
    )
    with pytest.raises(InputError) as caught:
        Scaling(names=("area_weight",)).check(10 * heavy, where="the training side")
    assert caught.value.fix.startswith("leave that target out, or train on a data set")


def test_the_aspect_is_the_logarithm_of_length_over_height() -> None:
    parameters = {
        "width": np.array([1.5, 2.0]),
        "height": np.array([1.0, 2.0]),
        "wind_speed": np.array([15.5, 3.0]),
    }
    found = truth(parameters, ("outdoor_wind", "log_aspect"))
    assert found[:, 0].tolist() == [15.5, 3.0]
    assert found[:, 1] == pytest.approx([0.4054651, 0.0])
    Scaling(names=("outdoor_wind", "log_aspect")).check(found, where="here")
    with pytest.raises(InputError, match="states its height"):
        truth({"width": np.array([1.5])}, ("log_aspect",))


@pytest.mark.parametrize(
    ("dataset", "weight"),
    [
        ("outdoor", "fabric_area_weight"),
        ("outdoor-damped", "fabric_area_weight"),
        ("world", "world_area_weight"),
        ("world-damped", "world_area_weight"),
    ],
)
def test_the_ranges_of_flags_outdoors_hold_all_that_their_data_sets_can_draw(
    dataset, weight
) -> None:
    from sim.datasets import load

    recipe = load(dataset)
    assert recipe.groups is not None
    scene, material = recipe.simulation.scene, recipe.simulation.material
    assert ends(recipe.simulation.wind.speed) == (
        TARGETS["outdoor_wind"].low,
        TARGETS["outdoor_wind"].high,
    )
    assert material.area_weight is not None
    assert ends(material.area_weight) == (TARGETS[weight].low, TARGETS[weight].high)
    aspects = [math.log(scene.width / height) for height in ends(recipe.groups.height)]
    assert TARGETS["log_aspect"].low < min(aspects)
    assert max(aspects) < TARGETS["log_aspect"].high
