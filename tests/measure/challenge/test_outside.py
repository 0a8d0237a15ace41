"""Effects outside the library keep the library's contract, and each does what its description says."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from flagdata.rng import stream
from measure.challenge.outside import OUTSIDE, button, places, seam, tether
from measure.challenge.outside.attraction import Attraction
from measure.challenge.outside.one_sided import OneSided
from measure.challenge.outside.passing_obstacle import PERIOD, PassingObstacle
from measure.challenge.outside.tether import Tether
from measure.challenge.outside.turning_pole import TurningPole
from measure.challenge.outside.updraft import Updraft
from measure.challenge.outside.vortex_street import STROUHAL, VortexStreet
from measure.challenge.outside.weft_friction import WeftFriction
from sim.effects import EFFECTS, Effect, apply
from sim.handles import Handles
from sim.integrate.symplectic import Backend, advance
from sim.material import named
from sim.mesh import grid
from sim.scene import Scene, assemble, upright
from sim.state import State
from sim.system import System

NAMES = list(OUTSIDE)
BATCH = 2
# 2.5 s into the run something passes; see `PassingObstacle`.
START = 2.5


def flag(turn: np.ndarray | None = None, shift: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> tuple[System, State]:
    """A folded, moving flag of full size, so that the cord from its lower corner is taut."""
    turn = np.eye(3) if turn is None else turn
    mesh = grid(width=1.5, height=1.0, columns=4, rows=3)
    u, v = mesh.rest.T
    start = np.stack([0.98 * u, 0.15 * u + 0.03 * np.sin(9 * u) * np.cos(7 * v), v - 0.1 * u], axis=1)
    scenes = [
        Scene(mesh=mesh, position=start @ turn.T + shift, material=named("camel-ponte-roma"),
              handles=Handles(vertices=(0, 3)), wind=tuple(turn @ wind))
        for wind in np.array([(5.0, 1.0, 0.2), (4.0, -2.0, 0.0)])
    ]  # fmt: skip
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
    effect = drawn(name)
    values: dict[str, Any] = {
        label: torch.tensor([effect.parameters()[label].null, float(getattr(effect, label)[1])], dtype=torch.float64)
        for label in effect.strengths()
    }
    changed, base = outcome(replace(effect, **values), flag()), outcome(None, flag())
    assert torch.equal(changed[..., 0], base[..., 0])
    # Rounding of float64 is 1e-15; the weakest of them moves something by micrometres a second.
    assert float((changed - base)[1, ..., 1].abs().max()) > 1e-7


@pytest.mark.parametrize("name", NAMES)
def test_turning_and_moving_everything_turns_and_moves_the_outcome(name: str) -> None:
    angle, shift = 0.7, (3.0, -2.0, 1.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    turned, still = outcome(drawn(name), flag(turn, shift)), outcome(drawn(name), flag())
    expected = torch.einsum("ij,svjb->svib", torch.tensor(turn), still)
    torch.testing.assert_close(turned[0] - torch.tensor(shift)[:, None], expected[0], rtol=0, atol=1e-10)
    # Strains lose digits to the shift, and stiff faces amplify that into velocities.
    torch.testing.assert_close(turned[1], expected[1], rtol=0, atol=1e-8)


def sheet_across(cells: int = 4) -> tuple[System, State]:
    """One square metre across a wind of 5 m/s in +x, at rest, its lower left corner at the origin."""
    mesh = grid(width=1.0, height=1.0, columns=cells, rows=cells)
    scene = Scene(mesh=mesh, position=upright(mesh), material=named("camel-ponte-roma"),
                  handles=Handles(vertices=(0, cells)), wind=(5.0, 0.0, 0.0))  # fmt: skip
    return assemble([scene], dtype=torch.float64)


def added(effect: Effect, *, cells: int = 4, turn: Tensor | None = None) -> Tensor:
    """(vertex, 3) what an effect adds to the external forces on that sheet, whose vectors may be turned [N]."""
    base, state = sheet_across(cells)
    if turn is not None:
        state = replace(state, position=torch.einsum("ij,vjb->vib", turn, state.position))
    system, state = apply([effect], base, state)
    wind = system.wind.velocity(0.0)
    force = system.external(wind, 0.0, state.position, state.velocity)
    return (force - base.external(wind, 0.0, state.position, state.velocity))[..., 0]


def test_the_vortex_street_sheds_at_the_strouhal_number() -> None:
    """At U = 5 m/s and D = 0.15 m with f = 0.2 U/D = 6.7 Hz; amplitude q U far behind the pole, on its axis."""
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
    """On a strip at distance r: p e^(−r/ℓ); over the sheet p ℓ (1 − e^(−1/ℓ)) = 0.432 p with ℓ = 0.5 m."""
    force = added(Attraction(pull=0.8), cells=16)
    # Vertices on the axis, which stand for half a cell of h = 62.5 mm, have no direction to be pulled in. The sum over
    # the others errs by the order of h²/ℓ² = 1.6 %.
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
    offset = torch.tensor([[0.0, 0.0, -2.0], [0.0, 0.0, 0.0], [0.0, 0.0, 2.0]], dtype=torch.float64)[..., None]
    up = Updraft(speed=1.2).field(0.0, offset, wind)[:, 2, 0]
    np.testing.assert_allclose(up, [1.2, 0.6, 0.0], atol=1e-5)


def test_the_obstacle_passes_once_a_period_from_right_to_left() -> None:
    effect, wind = PassingObstacle(share=0.5), torch.tensor([[5.0], [0.0], [0.0]], dtype=torch.float64)

    def speed(y: float, time: float) -> float:
        offset = torch.tensor([[[0.0], [y], [-0.3]]], dtype=torch.float64)
        return float(effect.field(time, offset, wind)[0, 0, 0])

    for y in (-1.0, 0.0, 1.0):
        passing = PERIOD * (y + 1.5) / 3.0
        assert speed(y, passing) == pytest.approx(2.5)
        assert speed(y, passing + 2 * PERIOD) == pytest.approx(2.5)
        assert speed(y, passing + PERIOD / 2) > 4.9


def test_friction_acts_along_the_weft_alone() -> None:
    """Tilted by 30° about the horizontal, the weft has a slope of sin 30° along the wind: c A (w·t) t."""
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
    force = frame.force(base.cloth, 0.0, state.position, back, torch.zeros(3, 1, dtype=torch.float64))
    level = arm * torch.tensor([[1.0], [1.0], [0.0]])
    torch.testing.assert_close(force, -(rate**2) * base.cloth.mass.unsqueeze(1) * level, rtol=1e-12, atol=1e-15)


def test_the_cord_pulls_the_lower_fly_corner_beyond_its_length_only() -> None:
    """The corner is at (0, 1, 0), the cord's end 1 m below the attachments' middle at (0, 0, −0.5): 1.118 m apart."""
    pull = added(Tether(stiffness=4.0, length=1.0))
    distance = math.hypot(1.0, 0.5)
    corner = 4 * 5  # of a grid of 4 × 4 cells, u slowest
    expected = 4.0 * (distance - 1.0)
    np.testing.assert_allclose(pull[corner], -expected * np.array([0.0, 1.0, 0.5]) / distance, atol=1e-12)
    assert int((pull.abs().sum(1) > 0).sum()) == 1
    assert float(added(Tether(stiffness=4.0, length=1.2)).abs().max()) == 0.0
    assert tether.DROP == 1.0


def test_the_two_sides_take_more_and_less_by_the_same_share() -> None:
    """ρ A U² = 25 N on the plain sheet; turned round, its other side faces the wind."""
    one = float(added(OneSided(share=0.2))[:, 0].sum())
    turn = torch.diag(torch.tensor([-1.0, -1.0, 1.0], dtype=torch.float64))
    other = float(added(OneSided(share=0.2), turn=turn)[:, 0].sum())
    assert {round(one, 9), round(other, 9)} == {5.0, -5.0}
