"""Fields of a cloth continued from within to its hoist and its fly.

A vertex at the end of a cloth has faces on one side only. A mean over them is that of half a cell
further in; a difference of such means along the cloth is then half of what it should be beside the
end, however small the cells are. What is to be differentiated along the cloth is therefore
continued to both ends from the vertices within, by a parabola through the three next to the end in
its row: means within have errors that vary smoothly along the cloth, and so has the parabola, so
that a difference keeps an error of the second order.

Where vertices are not in rows, it is by the least weights of the sixteen nearest that are right for
all parabolas.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray, IntArray

_SAME = 1e-6
"""Share of the cloth's size within which vertices are at an end, or in one row."""
_NEAREST = 16
_LARGEST = 12.0
"""Sum of the weights' sizes beyond which a vertex is left as it is: those next to it are nearly on
a line."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Ends:
    """Vertices at the hoist and the fly, and what their values are continued from.

    Attributes:
        vertices: (end,) indices.
        within: (end, k) indices of vertices that are at no end.
        weights: (end, k) of their values.
    """

    vertices: IntArray
    within: IntArray
    weights: FloatArray

    def continue_field(self, field: Tensor) -> Tensor:
        """Replaces a field's values (vertex, …) at the ends by those continued from within."""
        if not len(self.vertices):
            return field
        at, within = (
            torch.as_tensor(index, device=field.device) for index in (self.vertices, self.within)
        )
        weights = torch.as_tensor(self.weights, dtype=field.dtype, device=field.device)
        return field.index_copy(0, at, torch.einsum("ek,ek...->e...", weights, field[within]))


def ends_of(rest: FloatArray) -> Ends:
    """Finds the ends of a cloth of rest coordinates (vertex, 2), which run along it first [m].

    Vertices beside which too few others lie for a parabola are left out.
    """
    size = np.ptp(rest, axis=0)
    u = rest[:, 0]
    at_end = (u - u.min() <= _SAME * size[0]) | (u.max() - u <= _SAME * size[0])
    inner = np.flatnonzero(~at_end)
    ends: list[tuple[int, IntArray, FloatArray]] = []
    for vertex in np.flatnonzero(at_end).tolist():
        offsets = rest[inner] - rest[vertex]
        row = np.flatnonzero(np.abs(offsets[:, 1]) <= _SAME * size[1])
        nearest = row[np.argsort(np.abs(offsets[row, 0]), kind="stable")[:3]]
        if len(nearest) == 3:
            weights = _exact(offsets[nearest, :1] ** np.arange(3))
        else:
            nearest = np.argsort(np.hypot(*offsets.T), kind="stable")[:_NEAREST]
            a, b = offsets[nearest].T
            weights = _exact(np.stack([np.ones(len(nearest)), a, b, a * a, a * b, b * b], axis=1))
        if weights is not None and np.abs(weights).sum() <= _LARGEST:
            ends.append((vertex, inner[nearest], weights))
    width = max((len(nearest) for _, nearest, _ in ends), default=0)
    within, weights = np.zeros((len(ends), width), dtype=np.int64), np.zeros((len(ends), width))
    for index, (_, nearest, of_vertex) in enumerate(ends):
        within[index], weights[index, : len(nearest)] = np.resize(nearest, width), of_vertex
    return Ends(
        vertices=np.array([vertex for vertex, *_ in ends], dtype=np.int64),
        within=within,
        weights=weights,
    )


def _exact(terms: FloatArray) -> FloatArray | None:
    """Computes least weights (k,) of values at offsets that give polynomials of terms (k, term)
    their value at no offset; None where none do."""
    if len(terms) < terms.shape[1]:
        return None
    scaled = terms / np.maximum(np.abs(terms).max(0), np.finfo(float).tiny)
    wanted = np.arange(terms.shape[1]) == 0
    weights = np.linalg.lstsq(scaled.T, wanted.astype(float), rcond=1e-6)[0]
    return weights if np.abs(scaled.T @ weights - wanted).max() < 1e-9 else None
