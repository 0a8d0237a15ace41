"""Inertia against wind and gravity: a rigid plate, whose motion follows from one ordinary
differential equation."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flagdata.core.arrays import FloatArray
from measure.trajectories import (
    Hold,
    Known,
    Observation,
    Setup,
    Specimen,
    Trajectory,
    WindTrack,
    observe,
    sheet,
)
from measure.trajectories.checks.inertia_check import check_inertia, swing, wind_shown
from sim.cloth.air import QuadraticNormal
from sim.cloth.material import named_material
from sim.cloth.mesh import grid

WIDTH, HEIGHT, RATE, SPEED, DENSITY, GRAVITY = 1.2, 0.8, 50.0, 5.0, 1.3, 9.81
CLOTH = named_material("camel-ponte-roma")
REST = grid(width=WIDTH, height=HEIGHT, columns=12, rows=8).rest
TIMES = np.arange(150) / RATE


def experiment(positions: FloatArray, hold: Hold, wind: float) -> tuple[Trajectory, Specimen]:
    seen = Observation(
        name="plate",
        markers=REST,
        positions=positions,
        times=TIMES,
        noise=0.0,
        known=Known(wind=WindTrack.constant((wind, 0.0, 0.0))),
    )
    setup = Setup(
        outline=sheet(WIDTH, HEIGHT),
        material=CLOTH,
        pins=hold,
        air=QuadraticNormal(density=DENSITY),
        gravity=GRAVITY,
    )
    made = observe([seen], setup).experiment
    return made.recordings[0], made.specimen


def angles(acceleration, start: float) -> FloatArray:
    """(frame,) of φ'' = acceleration(φ, φ') from rest."""
    solved = solve_ivp(
        lambda _, y: (y[1], acceleration(*y)),
        (0, TIMES[-1]),
        (start, 0.0),
        t_eval=TIMES,
        rtol=1e-9,
        atol=1e-11,
    )
    return solved.y[0]


@pytest.fixture(scope="module")
def vane() -> tuple[Trajectory, Specimen]:
    """Hinged at an upright hoist: m W²/3 φ'' = ρ ∫ |w| w u du over the width, w = −U sin φ − u φ',
    per unit of area."""
    u = (np.arange(400) + 0.5) * WIDTH / 400

    def acceleration(angle: float, rate: float) -> float:
        across = -SPEED * np.sin(angle) - u * rate
        return float(
            DENSITY * (np.abs(across) * across * u).mean() / (CLOTH.area_weight * WIDTH**2 / 3)
        )

    turned = angles(acceleration, 1.2)
    shape = (len(TIMES), len(REST))
    along, height = np.broadcast_to(REST[:, 0], shape), np.broadcast_to(REST[:, 1], shape)
    plate = np.stack(
        [along * np.cos(turned)[:, None], along * np.sin(turned)[:, None], height], axis=-1
    )
    return experiment(plate, Hold.HOIST, SPEED)


@pytest.fixture(scope="module")
def pendulum() -> tuple[Trajectory, Specimen]:
    """Hung from its top in still air: φ'' = −3 g sin φ / (2 H)."""
    turned = angles(lambda angle, _: -1.5 * GRAVITY / HEIGHT * np.sin(angle), 0.8)
    shape = (len(TIMES), len(REST))
    down, along = np.broadcast_to(HEIGHT - REST[:, 1], shape), np.broadcast_to(REST[:, 0], shape)
    plate = np.stack(
        [along, down * np.sin(turned)[:, None], HEIGHT - down * np.cos(turned)[:, None]], axis=-1
    )
    return experiment(plate, Hold.TOP_CORNERS, 0.0)


@pytest.mark.parametrize(
    ("rate", "wind"), [(1.0, 1.0), (2.0, 1.0), (0.5, 1.0), (1.0, 3.6), (1.0, 1 / 3.6)]
)
def test_the_wind_that_a_vane_shows_goes_with_the_rate_and_not_with_the_wind_it_is_given(
    vane, rate, wind
) -> None:
    """To 6 %: the mesh's cells are a twelfth of the width, and differences span 40 ms."""
    recording, specimen = vane
    given = replace(recording.wind, velocity=wind * recording.wind.velocity)
    shown = wind_shown(replace(recording, rate=rate * RATE, wind=given), specimen)
    assert shown == pytest.approx(rate / wind, rel=0.06)


@pytest.mark.parametrize(("factor", "reported"), [(1.0, False), (2.0, True), (0.5, True)])
def test_a_swinging_plate_gains_what_its_height_loses_times_the_squared_error_of_the_rate(
    pendulum, factor, reported
):
    """To 5 %, as the vane's."""
    recording, specimen = pendulum
    recording = replace(recording, rate=factor * RATE)
    assert swing(recording, specimen) == pytest.approx(factor**2, rel=0.05)
    found = check_inertia(recording, specimen)
    assert [f.kind for f in found] == ["inertia-does-not-fit"] * reported


def test_the_rate_or_wind_that_would_fit_is_reported(vane) -> None:
    recording, specimen = vane
    (found,) = check_inertia(replace(recording, rate=2 * RATE), specimen)
    assert found.kind == "inertia-does-not-fit"
    assert "2 times the wind given" in found.what
    (mended,) = re.findall(r"([\d.]+) Hz would fit", found.fix or "")
    assert float(mended) == pytest.approx(RATE, rel=0.06)
    (found,) = check_inertia(
        replace(recording, wind=replace(recording.wind, velocity=3.6 * recording.wind.velocity)),
        specimen,
    )
    assert "0.28 m/s" in (found.fix or "")


def test_pins_on_no_line_and_motion_that_no_wind_explains_show_no_wind(vane) -> None:
    recording, specimen = vane
    held = (*specimen.held, specimen.mesh.vertex_count - 1)
    three = replace(
        specimen,
        held=held,
        anchors=specimen.mesh.rest[list(held)] @ np.array([[1.0, 0, 0], [0, 0, 1]]),
    )
    assert wind_shown(recording, three) is None
    shaken = (
        np.random.default_rng(0).normal(size=(len(TIMES), 1, 1)) * [0.0, 0.05, 0.0] * REST[:, :1]
    )
    assert wind_shown(replace(recording, positions=recording.positions + shaken), specimen) is None
