"""The columns, and the calibration they are beside."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from measure.forecasting import THETA, TURNED, Calibration, FieldColumn, Model, fields, library
from measure.forecasting.regressors import motions
from sim.cloth.material import named_material
from sim.cloth.scene import assemble, flag
from sim.effects import EFFECTS, WindEffect


def test_every_column_is_a_strength_of_the_library() -> None:
    for column in library():
        assert column.parameter in EFFECTS[column.effect].strengths()
        assert column.unit == EFFECTS[column.effect].parameters()[column.parameter].unit


def test_a_step_is_within_what_is_expected_of_the_strength() -> None:
    for column in library():
        low, high = column.described.prior
        assert abs(column.step) <= max(abs(low), abs(high)) * 4, column.name
        least, most = column.described.admissible
        assert least <= column.described.null + column.step <= most, column.name


def test_a_turned_wind_has_turned_before_a_segment_begins() -> None:
    (turned,) = (column for column in library() if column.name == TURNED)
    effect = turned.at(math.radians(10))
    assert isinstance(effect, WindEffect)
    wind = torch.tensor([5.0, 0.0, 0.0], dtype=torch.float64)[:, None]
    for time in (0.0, 0.04, 2.0):
        blown = effect.velocity(time, wind)[:, 0].tolist()
        assert blown == pytest.approx(
            [5 * math.cos(math.radians(10)), 5 * math.sin(math.radians(10)), 0.0]
        )


@given(area_weight=st.floats(-0.5, 0.5), bending=st.floats(-1.5, 1.5), damping=st.floats(-2.0, 4.0))
def test_steps_between_calibrations_undo_one_another(
    area_weight: float, bending: float, damping: float
) -> None:
    start = Calibration()
    moved = start.moved((area_weight, bending, damping))
    back = moved.moved(tuple(-step for step in moved.steps_from(start)))
    assert back.area_weight == pytest.approx(start.area_weight)
    assert back.bending == pytest.approx(start.bending)
    assert back.damping == pytest.approx(start.damping)


def test_a_calibration_scales_density_and_bending_and_sets_damping() -> None:
    nominal = named_material("camel-ponte-roma")
    material = Calibration(area_weight=1.1, bending=2.0, damping=1e-3).material(nominal)
    assert material.area_weight == pytest.approx(1.1 * nominal.area_weight)
    np.testing.assert_allclose(material.bending, 2 * nominal.bending)
    np.testing.assert_allclose(material.stretching, nominal.stretching)
    assert material.damping == 1e-3


def test_steps_are_natural_logarithms() -> None:
    moved = Calibration(damping=1e-3).moved((math.log(1.1), math.log(2.0), math.log(30.0)))
    assert moved.area_weight == pytest.approx(1.1)
    assert moved.bending == pytest.approx(2.0)
    assert moved.damping == pytest.approx(30e-3)
    assert len(THETA) == 3


def test_a_calibration_at_its_bounds_says_so() -> None:
    """Damping up to what cloth has, 30 ms and more, is none."""
    assert Calibration(damping=60e-3).at_bounds == ()
    far = Calibration().moved((20.0, 0.0, -20.0))
    assert far.at_bounds == ("area_weight", "damping")


def test_a_field_mode_is_a_force_per_mass_along_its_axis() -> None:
    system, state = assemble(
        [flag(material=named_material("camel-ponte-roma"), wind_speed=4.0, columns=6)],
        dtype=torch.float64,
    )
    column = FieldColumn(axis=2, mode=(1, 0), step=0.5)
    pushed, _ = column.system(system, state)
    (effect,) = pushed.effects
    force = effect.force(
        system.cloth, 0.0, state.position, state.velocity, system.wind.velocity(0.0)
    )
    u = system.cloth.mesh.rest[:, 0] / 1.5
    expected = 0.5 * np.cos(np.pi * u)
    np.testing.assert_allclose(
        (force[:, 2, 0] / system.cloth.mass[:, 0]).numpy(), expected, atol=1e-12
    )
    assert not force[:, :2].any()


def test_the_modes_are_different_columns() -> None:
    every = (*library(), *fields(), *motions())
    assert len({column.name for column in every}) == len(every)


def test_a_model_keeps_strengths_to_what_is_admissible() -> None:
    lift = next(column for column in library() if column.effect == "lift")
    model = Model(calibration=Calibration(), effects=((lift, 0.5),)).moved((0.0, 0.0, 0.0, -2.0))
    assert model.effects[0][1] == 0.0
    assert Model(calibration=Calibration(), effects=((lift, 0.5),)).acting[0].coefficient == 0.5
