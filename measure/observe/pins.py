"""Where the model mesh is held: the vertices of a named attachment, or one vertex at each given point."""

from __future__ import annotations

import numpy as np

from flagdata.errors import InputError
from measure.observe import cloth
from measure.observe.setup import Hold
from measure.observe.trajectory import Floats
from sim import handles
from sim.mesh import Mesh

_NAMED = {Hold.HOIST_CORNERS: handles.corners, Hold.TOP_CORNERS: handles.top_corners, Hold.HOIST: handles.full_hoist}
_NEAR = 1e-6
"""Share of the cloth's size: what is nearer than this is in one place."""


def hold(mesh: Mesh, pins: Hold | Floats) -> tuple[Mesh, tuple[int, ...]]:
    """The mesh with a vertex at each pin, and those vertices.

    Args:
        pins: a named attachment, or (pin, 2) in the mesh's coordinates [m]. Where no vertex is at a pin, the nearest
            is moved there: one of the edge to a pin on the edge, an inner one to a pin within, never a corner.

    Raises:
        InputError: a pin that is not on the cloth, or two in one place.
    """
    if isinstance(pins, Hold):
        return mesh, tuple(int(vertex) for vertex in _NAMED[pins](mesh.rest))
    rest, near = mesh.rest.copy(), _NEAR * float(np.ptp(mesh.rest, axis=0).max())
    corners = cloth.outline(mesh.rest, mesh.faces, where="model mesh")
    sharp = corners[cloth.sharp_corners(corners)]
    fixed = (np.hypot(*(rest[:, None] - sharp).transpose(2, 0, 1)) <= near).any(axis=1)
    edge = np.zeros(len(rest), dtype=bool)
    edge[mesh.boundary] = True
    held: list[int] = []
    for pin in pins:
        where = f"pin (u, v) = ({pin[0]:.4g}, {pin[1]:.4g}) m from the cloth's lower left"
        away = np.hypot(*(rest - pin).T)
        vertex = int(away.argmin())
        if away[vertex] > near:
            at_edge = cloth.distance_to(corners, pin) <= near
            if not at_edge and not cloth.inside(corners, pin[None])[0]:
                raise InputError(
                    "it is not on the cloth", where=where, fix="give pins in the coordinates of the markers, in metres"
                )
            free = (edge == at_edge) & ~fixed
            free[held] = False
            if not free.any():
                raise InputError("no vertex of the model mesh is free for it", where=where, fix="ask for more vertices")
            vertex = int(np.where(free, away, np.inf).argmin())
            rest[vertex] = pin
        if vertex in held:
            raise InputError("two pins in one place", where=where, fix="give each pin once")
        held.append(vertex)
    return Mesh(rest=rest, faces=mesh.faces), tuple(held)
