"""The moment of errors about the pole: what inner forces, and so most of what numerics do, cancel in.

Inner forces and those of the attachments, which lie on an axis, have no moment about it: M = Σ m (r × a)_z is that of
the air and of weight alone, whatever mesh, bending and stretch the cloth is computed with. The errors e of predictions
one horizon T ahead have, a unit of mass per area,

    M = Σ w (r × e)_z / T²,

w a marker's share of the cloth, r where it is observed, from the axis: the moment per density of what the model lacks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from measure.forecasting.segments import Segments
from measure.observe.interpolation import onto
from measure.observe.trajectory import Floats, Specimen


@dataclass(frozen=True, kw_only=True, eq=False)
class PoleMoment:
    """Moments about the pole of some segments.

    Attributes:
        arms: (frame, marker, 2, segment) w (−y, x)/T² [m³/s²] of the observed markers.
        scale: (segment,) root mean square moment of the base model's errors in the recording [m⁴/s²].
    """

    arms: Tensor
    scale: Tensor

    @classmethod
    def of(cls, errors: Tensor, segments: Segments, specimen: Specimen) -> PoleMoment:
        """About the vertical through the middle of the attachments, of errors (frame, marker, 3, segment) [m]."""
        anchors = [specimen.anchors if item.anchors is None else item.anchors for item in segments.items]
        axis = np.stack([own.mean(axis=0) for own in anchors], axis=-1)[None, None, :2]
        seen = segments.positions[segments.first :, :, :2] - axis
        share = shares(specimen, segments.markers)[None, :, None, None] / segments.period**2
        arms = torch.as_tensor(share * np.stack([-seen[:, :, 1], seen[:, :, 0]], axis=2)).to(errors)
        moment = (arms * errors[:, :, :2]).sum((1, 2))
        scale = torch.empty(len(segments)).to(errors)
        for index in np.unique(segments.recording):
            own = torch.as_tensor(np.flatnonzero(segments.recording == index), device=errors.device)
            scale[own] = (moment[:, own] ** 2).mean().sqrt()
        return cls(arms=arms, scale=scale)

    def moment(self, changes: Tensor) -> Tensor:
        """(change, frame, segment) over its scale, of (change, frame, marker, 3, segment) [m]."""
        return torch.einsum("fmxs,cfmxs->cfs", self.arms, changes[:, :, :, :2]) / self.scale

    @classmethod
    def joined(cls, parts: list[PoleMoment]) -> PoleMoment:
        """The segments of several, one after another."""
        return cls(arms=torch.cat([p.arms for p in parts], dim=-1), scale=torch.cat([p.scale for p in parts]))


def shares(specimen: Specimen, markers: Floats) -> Floats:
    """(marker,) of a cloth's area [m²], that of the vertices brought onto markers (marker, 2) [m]."""
    return specimen.mesh.vertex_areas @ onto(markers, specimen.mesh.rest)
