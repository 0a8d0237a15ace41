"""Fields of a cloth continued from within to its hoist and its fly.

A vertex at the end of a cloth has faces on one side only. A mean over them is that of half a cell further in, which is an error
of the first order; a difference of such means along the cloth is half of what it should be beside the end, whatever the
mesh. What is differentiated along the cloth is therefore taken, at both ends, from the vertices within:

- by a parabola through the three next to the end in its row, as mean values there have errors that vary smoothly: what
  is differentiated afterwards keeps an error of the second order;
- by a line through the two next to the end, for what is not differentiated any more.

Where vertices are not in rows, by the least weights of the sixteen nearest that are right for all polynomials of that degree.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_SAME = 1e-6
"""Share of the cloth's size within which vertices are at an end, or in one row."""
_NEAREST = 16
_LARGEST = 12.0
"""Sum of the weights' sizes beyond which a vertex is left as it is: those next to it are nearly on a line."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Ends:
    """Vertices at the hoist and the fly, and what their values are continued from.

    Attributes:
        vertices: (end,) indices.
        within: (end, k) indices of vertices that are at no end.
        parabola: (end, k) weights.
        line: (end, k) weights.
    """

    vertices: NDArray[np.int64]
    within: NDArray[np.int64]
    parabola: Floats
    line: Floats


def ends_of(rest: Floats) -> Ends:
    """The ends of a cloth of rest coordinates (vertex, 2), which run along it first [m].

    Vertices beside which too few others lie for a parabola are left out.
    """
    size = np.ptp(rest, axis=0)
    u = rest[:, 0]
    at_end = (u - u.min() <= _SAME * size[0]) | (u.max() - u <= _SAME * size[0])
    inner = np.flatnonzero(~at_end)
    found: list[tuple[int, NDArray[np.int64], Floats, Floats]] = []
    for vertex in np.flatnonzero(at_end).tolist():
        offsets = rest[inner] - rest[vertex]
        row = np.flatnonzero(np.abs(offsets[:, 1]) <= _SAME * max(size[1], size[0]))
        near = row[np.argsort(np.abs(offsets[row, 0]), kind="stable")[:3]]
        if len(near) == 3:
            along = offsets[near, 0]
            weights = _exact(along[:, None] ** np.arange(3)), np.append(_exact(along[:2, None] ** np.arange(2)), 0.0)
        else:
            near = np.argsort(np.hypot(*offsets.T), kind="stable")[:_NEAREST]
            a, b = offsets[near].T
            one = np.ones(len(near))
            weights = _exact(np.stack([one, a, b, a * a, a * b, b * b], 1)), _exact(np.stack([one, a, b], 1))
        if all(len(w) and np.abs(w).sum() <= _LARGEST for w in weights):
            found.append((vertex, inner[near], *weights))
    width = max((len(near) for _, near, _, _ in found), default=0)
    parabola, line = np.zeros((2, len(found), width))
    within = np.array([np.resize(near, width) for _, near, _, _ in found], dtype=np.int64).reshape(len(found), width)
    for place, (_, near, second, first) in enumerate(found):
        parabola[place, : len(near)], line[place, : len(near)] = second, first
    return Ends(
        vertices=np.array([vertex for vertex, *_ in found], dtype=np.int64),
        within=within,
        parabola=parabola,
        line=line,
    )


def _exact(terms: Floats) -> Floats:
    """(k,) least weights that give polynomials of terms (k, term), at offsets, their value at none; empty where none do."""
    scaled = terms / np.maximum(np.abs(terms).max(0), np.finfo(float).tiny) if len(terms) else terms
    wanted = np.zeros(terms.shape[1])
    wanted[0] = 1.0
    if len(terms) < terms.shape[1]:
        return np.empty(0)
    weights = np.linalg.lstsq(scaled.T, wanted, rcond=1e-6)[0]
    return weights if np.abs(scaled.T @ weights - wanted).max() < 1e-9 else np.empty(0)
