"""What a drape shows: drape coefficient, folds and lobes of its rim, from a registered mesh.

The drape coefficient is the area of the rim's projection beyond the pedestal over that of the flat
border (Cusick, J. Text. Inst. 59:253, 1968; ISO 9073-9). The rim's distance from the axis, R(φ) at
the angle φ that a vertex has in the
flat cloth, is a Fourier series: order 2 shows cloth that is stiffer along one thread, the higher
ones are folds.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import InputError
from sim.cloth.mesh import Mesh
from sim.run.cusick_drape import DISC, PEDESTAL

_ANGLES = 360
_FOLDS = range(3, 15)
"""Orders of the series that count as folds."""


@dataclass(frozen=True, kw_only=True)
class Shape:
    """What one drape shows.

    Attributes:
        coefficient: drape coefficient.
        lobe: amplitude of order 2 of the rim's distance from the axis, over the disc's radius:
            complex, its phase is twice the direction of the wider lobe.
        folding: root mean square of the orders 3 to 14, over the disc's radius.
        folds: the strongest of these orders.
        height: mean height of the rim over the pedestal's top [m].
        area: of the mesh over that of the flat cloth; 1 of a cloth that does not stretch and a scan
            that loses nothing.
    """

    coefficient: float
    lobe: complex
    folding: float
    folds: int
    height: float
    area: float

    def numbers(self) -> FloatArray:
        """Returns (7,) coefficient, real and imaginary part of the lobe, folding, folds, height,
        area."""
        coefficient, lobe, *others = astuple(self)
        return np.array([coefficient, lobe.real, lobe.imag, *others])


def rim_of(mesh: Mesh) -> IntArray:
    """Lists the vertices at the edge of a flat disc, by ascending angle."""
    rim = mesh.boundary
    return rim[np.argsort(np.arctan2(mesh.rest[rim, 1], mesh.rest[rim, 0]))]


def shape_of(
    mesh: Mesh,
    position: FloatArray,
    *,
    rim: IntArray | None = None,
    radius: float = DISC,
    pedestal: float = PEDESTAL,
) -> Shape:
    """Measures one drape.

    Args:
        mesh: the flat cloth, the pedestal's axis at the origin.
        position: (vertex, 3), z upwards from the pedestal's top, whose axis is at x = y = 0 [m].
        rim: as `rim_of` lists it, where it is known.
    """
    rim = rim_of(mesh) if rim is None else rim
    x, y, z = position[rim].T
    projected = abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))) / 2
    angle = np.arctan2(mesh.rest[rim, 1], mesh.rest[rim, 0])
    even = 2 * np.pi * np.arange(_ANGLES) / _ANGLES
    distance = np.interp(even, angle, np.hypot(x, y), period=2 * np.pi)
    series = 2 * np.conj(np.fft.rfft(distance)) / _ANGLES / radius
    folds = np.abs(series[list(_FOLDS)])
    corners = position[mesh.faces]
    spanned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return Shape(
        coefficient=(projected - np.pi * pedestal**2) / (np.pi * (radius**2 - pedestal**2)),
        lobe=complex(series[2]),
        folding=float(np.sqrt((folds**2).sum() / 2)),
        folds=int(_FOLDS[int(folds.argmax())]),
        height=float(np.interp(even, angle, z, period=2 * np.pi).mean()),
        area=float(np.linalg.norm(spanned, axis=1).sum() / (2 * mesh.areas.sum())),
    )


def place_scan(
    rest: FloatArray,
    position: FloatArray,
    *,
    where: str,
    radius: float = DISC,
    pedestal: float = PEDESTAL,
) -> tuple[FloatArray, FloatArray]:
    """Moves a scan's axis to the origin and the pedestal's top to z = 0, and scales its flat cloth
    to metres.

    Args:
        rest: (vertex, 2) in any unit, of a disc around any centre.
        position: (vertex, 3) [m], z upwards.
        where: the scan is from, for the message.

    Raises:
        InputError: the flat cloth is no disc, or what lies on the pedestal is not level.
    """
    low, high = rest.min(axis=0), rest.max(axis=0)
    extent = high - low
    if not (extent > 0).all() or abs(extent[0] / extent[1] - 1) > 0.02:
        raise InputError(
            f"the flat cloth measures {extent[0]:.4g} by {extent[1]:.4g}",
            where=where,
            fix="give texture coordinates of the flat disc, of equal width and height",
        )
    flat = (rest - (low + high) / 2) * (2 * radius / extent.mean())
    top = np.hypot(flat[:, 0], flat[:, 1]) < pedestal - 0.005
    if top.sum() < 3 or float(np.ptp(position[top, 2])) > 0.01:
        raise InputError(
            "the cloth on the pedestal is not level to 10 mm",
            where=where,
            fix="export positions in metres with z upwards, of a drape over a pedestal of "
            f"{pedestal:g} m radius",
        )
    # Of a rigid move: flat places on the pedestal go to where the scan has them.
    axis = position[top, :2].mean(axis=0) - flat[top].mean(axis=0)
    return flat, position - np.array([*axis, position[top, 2].mean()])
