"""Effects outside the library keep the library's contract, and each does what its description
says."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from flagdata.core.rng import stream
from sim.cloth.handles import Handles
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from sim.cloth.scene import Scene, assemble, upright
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import EFFECTS, Effect, apply
from sim.integrate import Backend, advance
from tests.studies.challenge.outside import OUTSIDE, button, places, seam, tether, vent, whirl
from tests.studies.challenge.outside.attraction import Attraction
from tests.studies.challenge.outside.balloon import DRAG, NET, Balloon
from tests.studies.challenge.outside.drawstring import Drawstring
from tests.studies.challenge.outside.fringes import Fringes
from tests.studies.challenge.outside.neighbour import Neighbour
from tests.studies.challenge.outside.one_sided import OneSided
from tests.studies.challenge.outside.passing_obstacle import PERIOD, PassingObstacle
from tests.studies.challenge.outside.sheltering_wall import CREST, ShelteringWall
from tests.studies.challenge.outside.spray import Spray
from tests.studies.challenge.outside.swaying_pole import SwayingPole
from tests.studies.challenge.outside.tether import Tether
from tests.studies.challenge.outside.turning_pole import TurningPole
from tests.studies.challenge.outside.updraft import Updraft
from tests.studies.challenge.outside.veer import Veer
from tests.studies.challenge.outside.vent import Vent
from tests.studies.challenge.outside.vortex_street import STROUHAL, VortexStreet
from tests.studies.challenge.outside.weft_friction import WeftFriction
from tests.studies.challenge.outside.whirl import Whirl

NAMES = list(OUTSIDE)
BATCH = 2
# 2.5 s into the run something passes; see `PassingObstacle`.
START = 2.5


def flag(
    turn: np.ndarray | None = None, shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> tuple[System, State]:
    """A folded, moving flag of full size, so that the cord from its lower corner is taut."""
    turn = np.eye(3) if turn is None else turn
    mesh = grid(width=1.5, height=1.0, columns=4, rows=3)
    u, v = mesh.rest.T
    start = np.stack(
        [0.98 * u, 0.15 * u + 0.03 * np.sin(9 * u) * np.cos(7 * v), v - 0.1 * u], axis=1
    )
    scenes = [
        Scene(
            mesh=mesh,
            position=start @ turn.T + shift,
            material=named_material("camel-ponte-roma"),
            handles=Handles(vertices=(0, 3)),
            wind=tuple(turn @ wind),
        )
        for wind in np.array([(5.0, 1.0, 0.2), (4.0, -2.0, 0.0)])
    ]
    system, state = assemble(scenes, dtype=torch.float64)
    speed = np.stack([np.cos(11 * v), 2 * np.sin(7 * u + 1), np.cos(5 * u) * v], axis=1) @ turn.T
    velocity = torch.tensor(speed).unsqueeze(-1).repeat(1, 1, BATCH)
    return system, replace(state, velocity=velocity, time=START)


def drawn(name: str) -> Effect:
    return OUTSIDE[name].drawn(stream(5, name), batch=BATCH)


def outcome(effect: Effect | None, batch: tuple[System, State]) -> Tensor:
    """Positions and velocities after 1.2 ms: (2, vertex, 3, batch)."""
    if effect is not None:
        fitted = effect.for_batch(BATCH, dtype=torch.float64, device=torch.device("cpu"))
        batch = fitted.apply(*batch)
    final = advance(*batch, 0.0012, steps=6, backend=Backend.TORCH)
    return torch.stack([final.position, final.velocity])


def test_none_is_in_the_library() -> None:
    assert not set(OUTSIDE) & set(EFFECTS)
    assert len(OUTSIDE) >= 8


@pytest.mark.parametrize("name", NAMES)
def test_every_parameter_has_unit_null_prior_and_source(name: str) -> None:
    effect = OUTSIDE[name]
    assert effect.strengths()
    for label, parameter in effect.parameters().items():
        least, most = parameter.admissible
        assert least <= parameter.prior[0] < parameter.prior[1] <= most, label
        assert least <= parameter.null <= most, label
        assert parameter.unit, label
        assert len(parameter.source) > 20, label
        assert f"{label}:" in effect.__doc__, label


@pytest.mark.parametrize("name", NAMES)
def test_a_member_at_null_is_the_base_models_to_the_bit_whatever_the_other_has(name: str) -> None:
    effect: Any = drawn(name)
    values: dict[str, Any] = {
        label: torch.tensor(
            [effect.parameters()[label].null, float(getattr(effect, label)[1])], dtype=torch.float64
        )
        for label in effect.strengths()
    }
    changed, base = outcome(replace(effect, **values), flag()), outcome(None, flag())
    assert torch.equal(changed[..., 0], base[..., 0])
    # Rounding of float64 is 1e-15; the weakest of them moves something by micrometres a second.
    assert float((changed - base)[1, ..., 1].abs().max()) > 1e-7


@pytest.mark.parametrize("name", NAMES)
def test_turning_and_moving_everything_turns_and_moves_the_outcome(name: str) -> None:
    angle, shift = 0.7, (3.0, -2.0, 1.0)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    turned, still = outcome(drawn(name), flag(turn, shift)), outcome(drawn(name), flag())
    expected = torch.einsum("ij,svjb->svib", torch.tensor(turn), still)
    torch.testing.assert_close(
        turned[0] - torch.tensor(shift)[:, None], expected[0], rtol=0, atol=1e-10
    )
    # Strains lose digits to the shift, and stiff faces amplify that into velocities.
    torch.testing.assert_close(turned[1], expected[1], rtol=0, atol=1e-8)


def sheet_across(cells: int = 4) -> tuple[System, State]:
    """One square metre across a wind of 5 m/s in +x, at rest, its lower left corner at the
    origin."""
    mesh = grid(width=1.0, height=1.0, columns=cells, rows=cells)
    scene = Scene(
        mesh=mesh,
        position=upright(mesh),
        material=named_material("camel-ponte-roma"),
        handles=Handles(vertices=(0, cells)),
        wind=(5.0, 0.0, 0.0),
    )
    return assemble([scene], dtype=torch.float64)


def added(effect: Effect, *, cells: int = 4, turn: Tensor | None = None) -> Tensor:
    """(vertex, 3) what an effect adds to the external forces on that sheet, whose vectors may be
    turned [N]."""
    base, state = sheet_across(cells)
    if turn is not None:
        state = replace(state, position=torch.einsum("ij,vjb->vib", turn, state.position))
    system, state = apply([effect], base, state)
    wind = system.wind.velocity(0.0)
    force = system.external(wind, 0.0, state.position, state.velocity)
    return (force - base.external(wind, 0.0, state.position, state.velocity))[..., 0]


def test_the_vortex_street_sheds_at_the_strouhal_number() -> None:
    """At U = 5 m/s and D = 0.15 m with f = 0.2 U/D = 6.7 Hz; amplitude q U far behind the pole, on
    its axis."""
    effect = VortexStreet(share=0.3)
    frequency = STROUHAL * 5 / 0.15
    place = torch.tensor([[[1.5], [0.0], [0.0]]], dtype=torch.float64)
    wind = torch.tensor([[5.0], [0.0], [0.0]], dtype=torch.float64)
    times = np.arange(64) / (16 * frequency)  # four periods
    cross = np.array([float(effect.field(t, place, wind)[0, 1, 0]) for t in times])
    spectrum = np.abs(np.fft.rfft(cross)) / 32
    assert int(spectrum.argmax()) == 4
    assert spectrum[4] == pytest.approx(0.3 * 5 * 1.5 / 1.65, rel=1e-9)
    assert float(effect.field(0.1, -place, wind)[0, 1, 0]) == 0.0


def test_attraction_pulls_every_part_horizontally_to_the_axis() -> None:
    """On a strip at distance r: p e^(−r/ℓ); over the sheet p ℓ (1 − e^(−1/ℓ)) = 0.432 p with ℓ =
    0.5 m."""
    force = added(Attraction(pull=0.8), cells=16)
    # Vertices on the axis, which stand for half a cell of h = 62.5 mm, have no direction to be
    # pulled in. The sum over the others errs by the order of h²/ℓ² = 1.6 %.
    expected = -0.8 * (0.5 * (1 - math.exp(-2)) - 0.0625 / 2)
    assert float(force[:, 1].sum()) == pytest.approx(expected, rel=0.016)
    assert float(force[:, [0, 2]].abs().max()) < 1e-15


def test_masses_on_the_cloth_have_their_weight_and_their_place() -> None:
    base, state = sheet_across()
    for effect, mass, place in (
        (button.Button(mass=0.05), 0.05, button.PLACE),
        (seam.Seam(line_density=0.04), 0.04, (seam.PLACE, 0.5)),
    ):
        system, _ = apply([effect], base, state)
        more = (system.cloth.mass - base.cloth.mass)[:, 0].numpy()
        assert more.sum() == pytest.approx(mass, rel=1e-12)
        np.testing.assert_allclose(more @ base.cloth.mesh.rest / mass, place, atol=1e-12)


def test_a_place_beyond_the_cloth_is_refused() -> None:
    with pytest.raises(ValueError, match="not on the cloth"):
        places.shares(grid(width=1.0, height=1.0, columns=2, rows=2), np.array([[1.2, 0.5]]))


def test_the_updraft_is_below_and_half_of_it_at_the_attachments_height() -> None:
    wind = torch.tensor([[5.0], [0.0], [0.0]], dtype=torch.float64)
    offset = torch.tensor(
        [[0.0, 0.0, -2.0], [0.0, 0.0, 0.0], [0.0, 0.0, 2.0]], dtype=torch.float64
    )[..., None]
    up = Updraft(speed=1.2).field(0.0, offset, wind)[:, 2, 0]
    np.testing.assert_allclose(up, [1.2, 0.6, 0.0], atol=1e-5)


def test_the_obstacle_passes_once_a_period_from_right_to_left() -> None:
    effect, wind = (
        PassingObstacle(share=0.5),
        torch.tensor([[5.0], [0.0], [0.0]], dtype=torch.float64),
    )

    def speed(y: float, time: float) -> float:
        offset = torch.tensor([[[0.0], [y], [-0.3]]], dtype=torch.float64)
        return float(effect.field(time, offset, wind)[0, 0, 0])

    for y in (-1.0, 0.0, 1.0):
        passing = PERIOD * (y + 1.5) / 3.0
        assert speed(y, passing) == pytest.approx(2.5)
        assert speed(y, passing + 2 * PERIOD) == pytest.approx(2.5)
        assert speed(y, passing + PERIOD / 2) > 4.9


def test_friction_acts_along_the_weft_alone() -> None:
    """Tilted by 30° about the horizontal, the weft has a slope of sin 30° along the wind: c A (w·t)
    t."""
    c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)
    turn = torch.tensor([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]], dtype=torch.float64)
    force = added(WeftFriction(coefficient=0.1), turn=turn).sum(0)
    expected = 0.1 * 5 * s * torch.tensor([s, 0.0, c], dtype=torch.float64)
    torch.testing.assert_close(force, expected, rtol=1e-12, atol=1e-14)
    # Across the wind the weft is vertical: nothing to rub along.
    assert float(added(WeftFriction(coefficient=0.1)).abs().max()) == 0.0


def test_a_body_at_rest_outside_a_turning_frame_turns_backward_in_it() -> None:
    """v = −Ω z × r is an orbit: the inertial forces are the centripetal −m Ω² r that it takes."""
    base, state = sheet_across()
    rate = 0.6
    arm = state.position - base.anchors.mean(0)
    back = -rate * torch.stack([-arm[:, 1], arm[:, 0], torch.zeros_like(arm[:, 0])], dim=1)
    system, _ = apply([TurningPole(rate=rate)], base, state)
    (frame,) = system.effects
    force = frame.force(
        base.cloth, 0.0, state.position, back, torch.zeros(3, 1, dtype=torch.float64)
    )
    level = arm * torch.tensor([[1.0], [1.0], [0.0]])
    torch.testing.assert_close(
        force, -(rate**2) * base.cloth.mass.unsqueeze(1) * level, rtol=1e-12, atol=1e-15
    )


def test_the_cord_pulls_the_lower_fly_corner_beyond_its_length_only() -> None:
    """The corner is at (0, 1, 0), the cord's end 1 m below the attachments' middle at (0, 0, −0.5):
    1.118 m apart."""
    pull = added(Tether(stiffness=4.0, length=1.0))
    distance = math.hypot(1.0, 0.5)
    corner = 4 * 5  # of a grid of 4 × 4 cells, u slowest
    expected = 4.0 * (distance - 1.0)
    np.testing.assert_allclose(
        pull[corner], -expected * np.array([0.0, 1.0, 0.5]) / distance, atol=1e-12
    )
    assert int((pull.abs().sum(1) > 0).sum()) == 1
    assert float(added(Tether(stiffness=4.0, length=1.2)).abs().max()) == 0.0
    assert tether.DROP == 1.0


def test_the_two_sides_take_more_and_less_by_the_same_share() -> None:
    """ρ A U² = 25 N on the plain sheet; turned round, its other side faces the wind."""
    one = float(added(OneSided(share=0.2))[:, 0].sum())
    turn = torch.diag(torch.tensor([-1.0, -1.0, 1.0], dtype=torch.float64))
    other = float(added(OneSided(share=0.2), turn=turn)[:, 0].sum())
    assert {round(one, 9), round(other, 9)} == {5.0, -5.0}


def air_at(effect: Any, *places_: tuple[float, float, float]) -> np.ndarray:
    """(place, 3) the air at offsets from the middle of the attachments, in a wind of 5 m/s in +x
    [m/s]."""
    wind = torch.tensor([[5.0], [0.0], [0.0]], dtype=torch.float64)
    return effect.field(0.0, torch.tensor(places_, dtype=torch.float64)[..., None], wind)[
        ..., 0
    ].numpy()


def test_the_wall_shelters_what_is_below_its_crest() -> None:
    air = air_at(ShelteringWall(share=0.6), (0.0, 0.0, -2.0), (0.0, 0.0, CREST), (0.0, 0.0, 2.0))
    np.testing.assert_allclose(air, np.outer([2.0, 3.5, 5.0], [1.0, 0.0, 0.0]), atol=1e-5)


def test_a_veering_wind_turns_by_its_rate_times_the_height_and_keeps_its_speed() -> None:
    air = air_at(Veer(rate=0.8), (0.3, 0.2, -0.5), (0.0, 0.0, 0.0), (0.0, -1.0, 1.0))
    np.testing.assert_allclose(np.arctan2(air[:, 1], air[:, 0]), [-0.4, 0.0, 0.8], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(air, axis=1), 5.0, rtol=1e-12)


def test_the_air_around_a_whirl_has_its_circulation() -> None:
    """Γ (1 − e^(−(r/c)²)) around a circle of radius r, counter-clockwise; none of it in the
    middle."""
    effect, angles, radius = (
        Whirl(circulation=3.0, core=0.3),
        np.linspace(0, 2 * np.pi, 24, endpoint=False),
        0.45,
    )
    x, y = whirl.PLACE
    circle = [(x + radius * math.cos(a), y + radius * math.sin(a), 0.2) for a in angles]
    tangent = np.stack([-np.sin(angles), np.cos(angles)], axis=1)
    around = (air_at(effect, *circle)[:, :2] * tangent).sum(axis=1).mean() * 2 * np.pi * radius
    assert around == pytest.approx(3.0 * (1 - math.exp(-(1.5**2))), rel=1e-12)
    np.testing.assert_allclose(air_at(effect, (x, y, 0.0))[0], [5.0, 0.0, 0.0], atol=1e-12)


def test_a_swaying_pole_pushes_every_mass_as_its_acceleration_asks() -> None:
    """m A ω² sin ω t, to the left of the wind: at a quarter of the period all of it, at a half
    none."""
    base, state = sheet_across()
    wind, effect = base.wind.velocity(0.0), SwayingPole(amplitude=0.05, frequency=2.0)
    mass = float(base.cloth.mass.sum())
    for time, share in ((0.125, 1.0), (0.25, 0.0), (0.375, -1.0)):
        push = effect.force(base.cloth, time, state.position, state.velocity, wind).sum(0)[:, 0]
        expected = [0.0, share * mass * 0.05 * (4 * math.pi) ** 2, 0.0]
        np.testing.assert_allclose(push, expected, atol=1e-12)


def test_drops_give_up_all_their_momentum() -> None:
    """A sheet of 1 m² across the wind catches L U of water a second, which has the velocity (U, 0,
    −V)."""
    caught = 0.01 * 5.0
    expected = caught * torch.tensor([5.0, 0.0, -7.0], dtype=torch.float64)
    torch.testing.assert_close(added(Spray(content=0.01)).sum(0), expected, rtol=1e-12, atol=1e-14)


def test_fringes_drag_at_the_fly_alone() -> None:
    """½ ρ b H U² = 0.5 · 1.225 · 0.2 · 1 · 25 N downwind, also on a cloth that lies along the
    wind."""
    along = torch.tensor([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)
    for turn in (None, along):
        force = added(Fringes(breadth=0.2), turn=turn)
        assert float(force[:20].abs().max()) == 0.0
        np.testing.assert_allclose(force.sum(0), [0.5 * 1.225 * 0.2 * 25, 0.0, 0.0], atol=1e-12)


def test_the_vent_takes_the_pressure_off_its_panel() -> None:
    """A share q of ρ U² = 25 N/m² over 0.4 · 0.6 m²."""
    area = float(np.prod(np.array(vent.HIGH) - np.array(vent.LOW)))
    force = added(Vent(share=0.5), cells=20)
    np.testing.assert_allclose(force.sum(0), [-0.5 * 25 * area, 0.0, 0.0], atol=1e-9)
    base, _ = sheet_across(20)
    centre = force[:, 0].numpy() @ base.cloth.mesh.rest / float(force[:, 0].sum())
    np.testing.assert_allclose(centre, np.add(vent.LOW, vent.HIGH) / 2, atol=1e-9)


def test_the_neighbour_swings_the_wind_at_its_own_frequency_and_the_wind_carries_it_along() -> None:
    effect = Neighbour(share=0.3, frequency=2.0)
    for speed in (4.0, 8.0):
        wind = torch.tensor([[speed], [0.0], [0.0]], dtype=torch.float64)
        near, far = (torch.tensor([[[x], [0.4], [0.1]]], dtype=torch.float64) for x in (0.0, 1.0))
        for time, share in ((0.125, 1.0), (0.25, 0.0), (0.375, -1.0)):
            expected = [speed, share * 0.3 * speed, 0.0]
            np.testing.assert_allclose(
                effect.field(time, near, wind)[0, :, 0], expected, atol=1e-12
            )
            np.testing.assert_allclose(
                effect.field(time + 1 / speed, far, wind)[0, :, 0], expected, atol=1e-12
            )


def test_a_balloon_lifts_and_is_blown_at_the_upper_fly_corner() -> None:
    """0.5 N of lift take a sphere of 0.45 m: ½ ρ C_D S U² = 1.15 N at 5 m/s."""
    force = added(Balloon(lift=0.5))
    corner = 4 * 5 + 4
    diameter = (6 * 0.5 / (math.pi * NET)) ** (1 / 3)
    assert diameter == pytest.approx(0.45, abs=0.005)
    blown = 0.5 * 1.225 * DRAG * math.pi / 4 * diameter**2 * 25
    np.testing.assert_allclose(force[corner], [blown, 0.0, 0.5], rtol=1e-12)
    assert int((force.abs().sum(1) > 0).sum()) == 1


def test_a_drawstring_pulls_the_ends_of_the_fly_together_until_it_is_gathered() -> None:
    force = added(Drawstring(tension=2.0))
    np.testing.assert_allclose(force[[20, 24], 2], [2.0, -2.0], atol=1e-12)
    assert float(force.sum(0).abs().max()) < 1e-12
    assert float(force[:20].abs().max()) == 0.0
    shrunk = torch.diag(torch.tensor([1.0, 1.0, 0.59], dtype=torch.float64))
    assert float(added(Drawstring(tension=2.0, gathered=0.6), turn=shrunk).abs().max()) == 0.0
