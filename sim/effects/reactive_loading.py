"""The reactive fluid loading of a sheet in a stream: what makes a flag flutter.

A sheet with small deflection η(x, t) in a stream U along x feels, per area, the pressure difference

    p = −m_a (∂t + U ∂x)² η = −m_a (η_tt + 2 U η_xt + U² η_xx)

with m_a the air's mass per area that moves with the sheet: π ρ H/4 for a slender strip (Lighthill,
J. Fluid Mech. 9:305, 1960), of the order of ρ L for a wide one; it is the non-circulatory part of
the load in Argentina and Mahadevan, PNAS 102:1829 (2005). The three terms are inertia, a
Coriolis-like coupling, and a centrifugal force that acts as compression.

For a sheet of any shape, with velocity v, unit normal n and air u, let V = (v − u)·n be the normal
velocity relative to the air and s = (u − v)_t the air's slip along the sheet. The operator (∂t + U
∂x) becomes the air's momentum V followed along the sheet, and the load −m_a (D V) n,

    D V = n·a + ṅ·(v − u) + s·∇_s V + ½ V ∇_s·s                    (u taken as slow: u̇ is left out)

For v = η_t e_z, n = e_z − η_x e_x, u = U e_x and small slopes the last term is of third order, and
the others are η_tt + U η_xt + U ∂x(η_t + U η_x): the equation above. The last makes it Lighthill's
large-amplitude theory (Proc. R. Soc. B 179:125, 1971) as Candelier, Boyer and Leroyer put it (J.
Fluid Mech. 668:196, 2011) for a sheet that does not stretch, ½ V ∇_s·s = −½ κ V². With it the
balance of energy closes: in air at rest, what the sheet gives is the change of ½ m_a V² over the
sheet, and ½ m_a V² s shed across its edge. The first term is the integrator's (see
`sim.cloth.inertia`), the others are a force. At the ends of the cloth the means over faces are
those of half a cell further in, which keeps that balance exactly and is a half of η_xx; continuing
them, as `sim.effects.finite_span_loading` does, costs runs here, where nothing else bounds short
waves (decision 052).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

from torch import Tensor

from sim.cloth.cloth_batch import Cloth
from sim.cloth.cloth_ends import Ends
from sim.cloth.inertia import mean_normal_rates, mean_normals, rest_areas
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects.added_mass import AddedMass, mass_per_area
from sim.effects.effect import ForceEffect
from sim.effects.parameter import Value


@dataclass(frozen=True, kw_only=True)
class ReactiveLoading(ForceEffect):
    """−m_a (∂t + U ∂x)² η on every vertex along its normal.

    Attributes:
        mass: m_a, per area of cloth.
    """

    effect_class: ClassVar[str] = "fluid-inertia"
    mass: Annotated[Value, mass_per_area(step=0.03)] = 0.0

    def apply(self, system: System, state: State) -> tuple[System, State]:
        system = replace(system, loads=(*system.loads, AddedMass(mass=self.mass)))
        return super().apply(system, state)

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        return (
            -self.mass
            * momentum_rates(cloth, position, velocity, wind)
            * mean_normals(cloth, position)
        )


def momentum_rates(
    cloth: Cloth, position: Tensor, velocity: Tensor, wind: Tensor, *, ends: Ends | None = None
) -> Tensor:
    """Computes a vertex's rest area times D V without the acceleration's term (see above): (vertex,
    1, batch) [m³/s²].

    Args:
        ends: at which V and s are continued from within; None where they are the means over faces
            there too, which are those of half a cell further in.
    """
    relative = velocity - wind
    normal = mean_normals(cloth, position)
    turning = mean_normal_rates(cloth, position, velocity)
    across = (relative * normal).sum(1, keepdim=True)
    slip = across * normal - relative
    if ends is not None:
        across, slip = ends.continue_field(across), ends.continue_field(slip)

    g0, g1, g2 = shape_gradients(cloth, position)
    v0, v1, v2 = cloth.at_corners(across)
    s0, s1, s2 = cloth.at_corners(slip)
    following = ((s0 + s1 + s2) / 3 * (g0 * v0 + g1 * v1 + g2 * v2)).sum(1, keepdim=True)
    spreading = (v0 + v1 + v2) / 3 * (g0 * s0 + g1 * s1 + g2 * s2).sum(1, keepdim=True)
    swept = (cloth.areas / 3)[:, None, None] * (following + spreading / 2)
    return rest_areas(cloth)[:, None, None] * (turning * relative).sum(
        1, keepdim=True
    ) + cloth.shared_out(swept)


def shape_gradients(cloth: Cloth, position: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Gradients along the faces of the linear shapes that are 1 at a corner: (face, 3, batch) each
    [1/m].

    Those of the flat cloth, carried along by its tangents x_u and x_v: exact where the cloth is not
    stretched, and finite where a face collapses.
    """
    corners = cloth.at_corners(position)
    d = cloth.gradients[..., None, None]
    along_u, along_v = (
        d[:, a, 0] * corners[0] + d[:, a, 1] * corners[1] + d[:, a, 2] * corners[2]
        for a in range(2)
    )
    first, second = (d[:, 0, c] * along_u + d[:, 1, c] * along_v for c in range(2))
    return first, second, -first - second
