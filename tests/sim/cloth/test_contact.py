"""Self-contact: its forces, and what they keep apart."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.errors import InputError
from sim.cloth import contact
from sim.cloth.contact import Contact
from sim.cloth.handles import Handles
from sim.cloth.material import isotropic, named_material
from sim.cloth.mesh import Mesh, grid
from sim.cloth.scene import assemble, flag
from sim.cloth.state import State
from sim.integrate import Backend, BackwardEuler, Symplectic, advance
from sim.kernel import Kernel
from tests.refusals import unrefused
from tests.sim.conftest import make_system

G = 9.81


def pleated(system, state, *, noise: float = 1e-3):
    """The sheet folded like an accordion, layers 4 mm apart and crossing here and there, in
    motion."""
    u, v = system.cloth.mesh.rest.T
    layer, share = np.divmod(u, 0.2)
    along = np.where(layer % 2 == 0, share, 0.2 - share)
    members = []
    for b in range(system.cloth.batch):
        rough = noise * np.random.default_rng(b).normal(size=(len(u), 3))
        members.append(np.stack([0.004 * layer + 0.003 * np.sin(31 * v), along, v], axis=1) + rough)
    position = torch.tensor(np.stack(members, axis=-1), dtype=state.position.dtype)
    return State(position=position, velocity=torch.sin(57 * position.roll(1, 1)))


@pytest.fixture
def folded():
    mesh = grid(width=0.8, height=0.3, columns=16, rows=6)
    system, state = make_system(
        mesh,
        [
            named_material("camel-ponte-roma"),
            named_material("gray-interlock"),
            named_material("royal-target"),
        ],
    )
    system = replace(system, contact=Contact())
    return system, pleated(system, state)


def pairs_of(system, position):
    return contact.candidates(system.cloth, system.contact, position, system.neighbours)


def test_repulsion_is_minus_the_gradient_of_its_energy(folded) -> None:
    system, state = folded
    smooth = replace(system, contact=Contact(friction=0.0))
    position = state.position.clone().requires_grad_()
    energy = contact.energy(
        smooth.cloth, smooth.contact, position, pairs_of(smooth, state.position)
    )
    assert bool((energy > 0).all())
    (gradient,) = torch.autograd.grad(energy.sum(), position)
    still = torch.zeros_like(state.velocity)
    force = contact.force(
        smooth.cloth, smooth.contact, state.position, still, pairs_of(smooth, state.position)
    )
    torch.testing.assert_close(force, -gradient, rtol=1e-8, atol=1e-10)


def test_contact_keeps_momentum(folded) -> None:
    system, state = folded
    pairs = pairs_of(system, state.position)
    force = contact.force(system.cloth, system.contact, state.position, state.velocity, pairs)
    assert float(force.abs().max()) > 0.1
    assert float(force.sum(0).abs().max()) < 1e-11 * float(force.abs().sum())


def test_contact_takes_energy_from_sliding_layers(folded) -> None:
    system, state = folded
    pairs = pairs_of(system, state.position)
    still = contact.force(
        system.cloth, system.contact, state.position, torch.zeros_like(state.velocity), pairs
    )
    force = contact.force(system.cloth, system.contact, state.position, state.velocity, pairs)
    assert bool((((force - still) * state.velocity).sum((0, 1)) < 0).all())


def test_kernel_finds_and_pushes_what_the_definition_does(folded) -> None:
    system, state = folded
    kernel = Kernel.of(system)
    assert kernel is not None
    drive = system.drive(0.0, 0.04)
    expected = system.force(drive, 0.0, 0.0, state.position, state.velocity)
    computed = kernel.forces(drive, 0.0, state.position, state.velocity)
    assert float((computed - expected).abs().max()) < 1e-9 * float(expected.abs().max())
    # Over many steps the kernel keeps candidates while vertices move; the definition looks at all
    # pairs every time.
    results = [
        advance(system, state, 6e-3, steps=40, backend=b).position
        for b in (Backend.TORCH, Backend.KERNEL)
    ]
    torch.testing.assert_close(results[1], results[0], rtol=0, atol=1e-6)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_what_the_kernel_remembers_of_other_states_changes_nothing_to_the_bit(dtype) -> None:
    mesh = grid(width=0.8, height=0.3, columns=16, rows=6)
    system, state = make_system(mesh, [named_material("camel-ponte-roma")] * 3, dtype=dtype)
    used, fresh = replace(system, contact=Contact()), replace(system, contact=Contact())
    start = pleated(used, state)
    for other in (
        start,
        state,
        pleated(used, state, noise=5e-3),
        replace(start, position=start.position * torch.nan),
    ):
        advance(used, other, 6e-3, steps=40)
    first, second = (advance(chosen, start, 6e-3, steps=40) for chosen in (used, fresh))
    assert torch.equal(first.position, second.position)
    assert torch.equal(first.velocity, second.velocity)
    apart = advance(replace(system, contact=None), start, 6e-3, steps=40)
    assert float((apart.position - first.position).abs().max()) > 1e-4


def test_flat_cloth_and_its_neighbouring_faces_do_not_touch() -> None:
    mesh = grid(width=0.4, height=0.2, columns=16, rows=8)
    system, state = make_system(mesh, [named_material("gray-interlock")])
    system = replace(system, contact=Contact())
    # Faces of 25 mm, thickness 10 mm: only what is far in the cloth can touch.
    assert (
        float(
            contact.energy(
                system.cloth, system.contact, state.position, pairs_of(system, state.position)
            )
        )
        == 0.0
    )


def test_a_patch_slides_to_rest_as_coulomb_says() -> None:
    # A patch on a level, rigidly held sheet: deceleration μ g, from 0.6 m/s to rest after v²/(2 μ
    # g).
    base = grid(width=1.0, height=0.3, columns=20, rows=6)
    patch = grid(width=0.1, height=0.1, columns=2, rows=2)
    mesh = Mesh(
        rest=np.concatenate([base.rest, patch.rest + np.array([5.0, 0.0])]),
        faces=np.concatenate([base.faces, patch.faces + base.vertex_count]),
    )
    material = isotropic(
        name="stiff", area_weight=0.3, stretching=2000.0, shear=2000.0, bending=1e-3, damping=2e-4
    )
    handles = Handles(vertices=tuple(range(base.vertex_count)), stiffness=math.inf)
    friction = 0.5
    system, state = make_system(mesh, [material], handles=handles, gravity=(0.0, 0.0, -G))
    system = replace(system, contact=Contact(friction=friction))
    flat = np.concatenate([base.rest, patch.rest + np.array([0.1, 0.1])])
    height = np.concatenate([np.zeros(base.vertex_count), np.full(patch.vertex_count, 0.0095)])
    position = torch.tensor(np.concatenate([flat, height[:, None]], axis=1)).unsqueeze(-1)
    system = replace(system, anchors=position[system.held].clone())
    state = replace(state, position=position)
    state = Symplectic().advance(system, state, 0.2)  # comes to lie
    velocity = torch.zeros_like(state.velocity)
    velocity[base.vertex_count :, 0] = 0.6
    state = replace(state, velocity=velocity)
    start = state.position[base.vertex_count :, 0].mean()
    half = Symplectic().advance(system, state, 0.06)
    # Edges of the patch ride on faces one after the other: pressure and so friction ripple by some
    # per cent.
    speed = float(half.velocity[base.vertex_count :, 0].mean())
    assert speed == pytest.approx(0.6 - friction * G * 0.06, rel=0.06)
    end = Symplectic().advance(system, half, 0.4)
    # Below the sticking speed of 0.02 m/s it creeps.
    slid = float(end.position[base.vertex_count :, 0].mean() - start)
    assert slid == pytest.approx(0.6**2 / (2 * friction * G), rel=0.1)


# With steps of 5 ms a layer moves a fifth of the thickness in a step before it is pushed back.
@pytest.mark.parametrize(
    ("method", "frames", "gap"), [(Symplectic(), 50, 4e-3), (BackwardEuler(), 30, 2e-3)]
)
def test_layers_of_a_calm_flag_stay_apart_with_contact_and_cross_without(
    method, frames, gap
) -> None:
    scene = flag(material=named_material("camel-ponte-roma"), wind_speed=0.5, columns=12)
    scene = replace(
        scene,
        position=scene.position + np.random.default_rng(1).normal(0, 1e-4, scene.position.shape),
    )
    closest = {}
    for setting in (None, Contact()):
        system, state = assemble([replace(scene, contact=setting)], dtype=torch.float64)
        judge = replace(system, contact=Contact())
        least = math.inf
        for _ in range(frames):
            state = method.advance(system, state, 0.04)
            touch = contact.touching(
                judge.cloth, judge.contact, state.position, pairs_of(judge, state.position)
            )
            if len(touch.violation):
                least = min(least, judge.contact.thickness - float(touch.violation.max()))
        assert bool(state.healthy().all())
        closest[setting] = least
    assert closest[None] < 1e-3
    assert closest[Contact()] > gap


def test_the_automatic_step_stays_stable_over_ten_seconds_of_layers_on_one_another() -> None:
    # An unstable step feeds the fastest vibrations without end. A flag that hangs keeps less than a
    # tenth of the kinetic energy of its fall: the weak wind moves it a little.
    winds = np.linspace(0.0, 1.0, 16)
    scenes = [
        flag(material=named_material("camel-ponte-roma"), wind_speed=w, columns=15) for w in winds
    ]
    system, state = assemble([replace(scene, contact=Contact()) for scene in scenes])
    energies, touches = [], 0
    for frame in range(250):
        state = Symplectic().advance(system, state, 0.04)
        energies.append((system.cloth.mass * (state.velocity**2).sum(1)).sum(0) / 2)
        if frame % 50 == 49:
            touch = contact.touching(
                system.cloth, system.contact, state.position, pairs_of(system, state.position)
            )
            touches += len(touch.violation)
    kinetic = torch.stack(energies)
    assert bool(state.healthy().all())
    assert touches > 0
    assert bool((kinetic[-50:].mean(0) < kinetic.amax(0) / 10).all())


def test_impossible_contacts_are_refused() -> None:
    cases = [{"thickness": 0.0}, {"stiffness": -1.0}, {"friction": -0.1}, {"friction": math.nan}]
    assert not unrefused(lambda fields: Contact(**fields), zip(cases), InputError, "contact")
