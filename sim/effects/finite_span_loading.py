"""The inertia of the air beside a sheet of finite height in a stream.

As `sim.effects.reactive_loading`, −m_a (∂t + U ∂x)² η, with the air's mass of potential flow for a
wave of wavenumber k on a strip of height H,

    m(k) = s ρ / ((k/2)^(3/2) + (4/(π H))^(3/2))^(2/3),

which is 2 ρ/k for waves that are short beside H (an unbounded sheet, both sides) and π ρ H/4 for
long ones (Lighthill's elongated body, J. Fluid Mech. 9:305, 1960, mean over the height); between
them the exponent is chosen, and the mass within 4 % of the potential flow of a strip
(`tests/sim/effects/test_finite_span_loading.py`; the effect of the span on
flutter: Eloy, Souilliez and Schouveiler, J. Fluids Struct. 23:904, 2007). A mass that does not fall
with k would make every short wave grow.

Over the height the load is that of an elongated body, e(ζ) = (4/π) √(1 − ζ²) at ζ from −1 to 1:
nothing at the free edges.

The load R = D V of the reactive loading without its first term is taken apart into cosines along
the cloth and over its height, each multiplied by m(k)/m(k₀) for its own k, and put together again:

    −m(k₀) √e F[√e R] n

V and the slip are continued to the hoist and the fly from within before they are differentiated
(`sim.cloth.cloth_ends`).

F is symmetric and the same at all times, so that the Coriolis term does no work within the sheet
and the centrifugal one is the gradient of an energy, as without it. The first term, the
acceleration's, is a mass m(k₀) e of each vertex (see `sim.cloth.inertia`), of the wave of twice the
cloth's length, k₀ = π/L; that of shorter waves is too large, as they are carried too slowly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray
from sim.cloth.cloth_batch import Cloth
from sim.cloth.inertia import mean_normals, rest_areas
from sim.cloth.mesh import Mesh
from sim.cloth.state import State
from sim.cloth.system import InapplicableError, System
from sim.effects.effect import ForceEffect
from sim.effects.parameter import NOT_NEGATIVE, Value, strength
from sim.effects.quantities import AIR_DENSITY, AirDensity
from sim.effects.reactive_loading import momentum_rates
from sim.kernel.effect_code import Given

_ALONG, _ACROSS = 10, 4
"""Modes along the cloth and over its height, at most; as in the C++."""


@dataclass(frozen=True, kw_only=True)
class FiniteSpanLoading(ForceEffect):
    """−m (∂t + U ∂x)² η with the mass of air s m(k) that a wave of wavenumber k on a strip of
    height H moves.

    m(k) = ρ ((k/2)^(3/2) + (4/(π H))^(3/2))^(−2/3): 2 ρ/k for short waves, π ρ H/4 for long ones.

    Attributes:
        share: s; 1 for potential flow.
        density: ρ of the air.
    """

    effect_class: ClassVar[str] = "fluid-inertia"
    revision: ClassVar[int] = 2  # the ends continued from within
    share: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.2, 1.2),
            weighed=(0.05, 1.2),
            step=0.05,
            admissible=NOT_NEGATIVE,
            source="1 by potential flow; a wake and the flow around the hoist take a part away: "
            "thresholds of flutter "
            "ask for a half to all of it (Eloy, Lagrange, Souilliez and Schouveiler, J. Fluid "
            "Mech. 611:97, 2008)",
        ),
    ] = 0.0
    density: AirDensity = AIR_DENSITY

    def added_mass(self, cloth: Cloth) -> Tensor:
        """Computes the added mass, (vertex, batch) [kg]."""
        profile = torch.as_tensor(
            profile_over_height(cloth.mesh), dtype=cloth.dtype, device=cloth.device
        )
        mass = self._longest(cloth.mesh) * (rest_areas(cloth) * profile)[:, None]
        return mass.expand_as(cloth.mass)

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        def real(values: FloatArray) -> Tensor:
            return torch.as_tensor(values, dtype=cloth.dtype, device=cloth.device)

        modes, gains = real(cosines(cloth.mesh)), real(relative_masses(cloth.mesh))
        root = real(np.sqrt(profile_over_height(cloth.mesh)))[:, None]
        rates = momentum_rates(cloth, position, velocity, wind, ends=cloth.mesh.ends)[:, 0]
        smooth = modes @ (gains[:, None] * (modes.T @ (root * rates)))
        size = self._longest(cloth.mesh) * rest_areas(cloth)[:, None] * root * smooth
        return -size.unsqueeze(1) * mean_normals(cloth, position)

    def apply(self, system: System, state: State) -> tuple[System, State]:
        if not (np.abs(2 * angles(system.cloth.mesh)[1] / np.pi - 1) < 0.99).any():
            raise InapplicableError(
                "the cloth has no vertex between its two free edges, over which the load falls to "
                "nothing",
                where="effects.finite-span-loading",
                fix="give a mesh of two or more rows of cells",
            )
        return super().apply(replace(system, loads=(*system.loads, self)), state)

    def given(self, cloth: Cloth) -> Given:
        """Lists what its C++ reads: the mass, those of the modes, and of each vertex the first
        cosines and √e."""
        mesh = cloth.mesh
        along, over = angles(mesh)
        columns = np.stack(
            [np.cos(along), np.cos(over), np.sqrt(profile_over_height(mesh))], axis=1
        )
        of_vertex = torch.as_tensor(columns, dtype=cloth.dtype, device=cloth.device)[..., None]
        numbers = (self._longest(mesh), *(float(gain) for gain in relative_masses(mesh)))
        return Given(
            of=type(self), numbers=numbers, own=of_vertex.expand(-1, -1, cloth.batch).contiguous()
        )

    def _longest(self, mesh: Mesh) -> Value:
        """Computes m(k₀) [kg/m²]."""
        length, height = extent(mesh)
        return self.share * self.density * strip_mass(np.pi / length, height)


def strip_mass(wavenumber: float, height: float) -> float:
    """Computes m/ρ of potential flow for a wave [1/m] on a strip of a height [m], mean over it
    [m]."""
    return ((wavenumber / 2) ** 1.5 + (4 / (np.pi * height)) ** 1.5) ** (-2 / 3)


def extent(mesh: Mesh) -> tuple[float, float]:
    """Computes length and height of the flat cloth [m]."""
    length, height = np.ptp(mesh.rest, axis=0)
    return float(length), float(height)


def angles(mesh: Mesh) -> tuple[FloatArray, FloatArray]:
    """Computes angles (vertex,) from 0 to π along the cloth and over its height."""
    along, over = (np.pi * (mesh.rest - mesh.rest.min(0)) / extent(mesh)).T
    return along, over


def profile_over_height(mesh: Mesh) -> FloatArray:
    """Computes the profile e (vertex,), nothing at the free edges, of mean 1 over the cloth."""
    _, over = angles(mesh)
    shape = np.sqrt(np.clip(1 - (2 * over / np.pi - 1) ** 2, 0, None))
    return np.asarray(shape * mesh.vertex_areas.sum() / (shape * mesh.vertex_areas).sum())


def cosines(mesh: Mesh) -> FloatArray:
    """Computes (vertex, mode) cosines, those along the cloth innermost."""
    along, over = angles(mesh)
    first = np.cos(np.arange(_ALONG) * along[:, None])
    second = np.cos(np.arange(_ACROSS) * over[:, None])
    return (second[:, :, None] * first[:, None]).reshape(len(along), -1)


def relative_masses(mesh: Mesh) -> FloatArray:
    """Computes (mode,) m(k)/m(k₀) over the mode's square integrated over the cloth [1/m²].

    Nothing for modes that half a wave of the mesh's cells does not resolve.
    """
    length, height = extent(mesh)
    k = np.hypot(
        np.pi / length * np.arange(_ALONG), (np.pi / height * np.arange(_ACROSS))[:, None]
    ).ravel()
    masses = np.array([strip_mass(wavenumber, height) for wavenumber in k]) / strip_mass(
        np.pi / length, height
    )
    cell = np.sqrt(2 * mesh.areas.mean())
    squares = (cosines(mesh) ** 2 * mesh.vertex_areas[:, None]).sum(0)
    return np.where(k < np.pi / (2 * cell), masses / squares, 0.0)
