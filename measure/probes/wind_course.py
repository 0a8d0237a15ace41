"""The course of the wind within a recording, estimated from errors: what a steady wind's model
takes for gusts.

In windows of 0.2 s the errors e are fitted by a wind that is a share c of the mean one stronger,
turned to its left, or
upward: c = g/h with g = Σ w e·s and h = Σ w s², s the sensitivity of the predictions to such a
wind. A wind that is the logged one leaves a c that is alike in all windows, but for what the
numerics do, by whatever parameters and steady effects the model is off. How c of neighbouring
windows vary together about its mean over the recording, Σ √(h h') c c', holds what lasts for some
tenths of a second, not the noise.

Turbulence turns the wind as well, by 0.6 to 1 of what it does along it, and changes slowly: eddies
of L ≥ 10 m take more than a second to go by. Of courses drawn from von Kármán's spectrum (L from 10
to 150 m in 4 and 8 m/s, three recordings of 8 s) 1 % turn by less than 0.43 to 0.51 of what they
vary along the wind by this measure, where it is 0.78 in all, and by less than 0.33 to 0.39 where it
is 0.6; 1 % vary within 2 s by more than 1.1 to 1.9 of what they do from one 2 s to another. Whether
the wind rises means little: what pushes a flag along the wind lifts it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray, IntArray
from measure.probes.segment_rows import StatisticRows
from measure.verdict.criteria import CRITERIA

ALONG, LEFT = 0, 1
_WINDOW = 0.2
"""s: most of what a whipping edge does is slower, most of what noise does faster."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Course(StatisticRows):
    """The wind's course in segments.

    Attributes:
        score: (segment, window, part) g, of errors over their scale; parts are along the wind, to
            its left, upward.
        curvature: (segment, window, part, part) H = Σ w s·s', h on its diagonal.
        log: (segment, window, part, nuisance) how g moves with what the wind's log may be off by;
            None where the wind is known.
    """

    score: FloatArray
    curvature: FloatArray
    log: FloatArray | None = None

    def swing(self, recording: IntArray) -> FloatArray:
        """Computes Σ √(h h') c c' over neighbouring windows, c about its recording's mean, a
        segment, (part,).

        In units of the errors' scale, so that errors that are larger all over leave no larger ones.

        Args:
            recording: (segment,) of each.
        """
        value, weight = self._about(recording), self._together
        return (weight * value[:, :-1] * value[:, 1:]).sum(axis=(0, 1)) / len(recording)

    def variation(self, recording: IntArray) -> Variation:
        """Computes how the wind varies, as shares of its mean."""
        value, weight = self._about(recording), self._together
        within = value - self._mean(value)
        total, fast = (
            (weight * c[:, :-1] * c[:, 1:]).sum(axis=(0, 1)) / weight.sum(axis=(0, 1))
            for c in (value, within)
        )
        # The error of a ratio of sums over segments, of which each may be another.
        residuals = (weight * (value[:, :-1] * value[:, 1:] - total)).sum(axis=1)
        error = np.sqrt((residuals**2).sum(axis=0)) / weight.sum(axis=(0, 1))
        return Variation(total=total, fast=fast, error=error)

    @property
    def _together(self) -> FloatArray:
        """(segment, window − 1, part) weights of products of neighbours."""
        return np.sqrt(self._diagonal[:, :-1]) * np.sqrt(
            self._diagonal[:, 1:]
        )  # a product of two that are tiny is none

    @property
    def _diagonal(self) -> FloatArray:
        """Returns h, (segment, window, part)."""
        return np.maximum(np.einsum("swpp->swp", self.curvature), np.finfo(np.float64).tiny)

    def _mean(self, value: FloatArray) -> FloatArray:
        """Averages over the windows, (segment, 1, part)."""
        return (self._diagonal * value).sum(axis=1, keepdims=True) / self._diagonal.sum(
            axis=1, keepdims=True
        )

    def _about(self, recording: IntArray) -> FloatArray:
        """Computes c less its recording's mean, and less what its log may be off by, (segment,
        window, part)."""
        value = self._centre_scores(self.score, recording)
        if self.log is None:
            return value
        off = np.stack(
            [self._centre_scores(self.log[..., k], recording) for k in range(self.log.shape[-1])],
            axis=-1,
        )
        for index in np.unique(recording):
            in_recording = recording == index
            weighted = self._diagonal[in_recording][..., None] * off[in_recording]
            curvature = np.einsum("swpj,swpk->jk", weighted, off[in_recording]) + np.eye(
                off.shape[-1]
            )
            value[in_recording] -= off[in_recording] @ np.linalg.solve(
                curvature, np.einsum("swpk,swp->k", weighted, value[in_recording])
            )
        return value

    def _centre_scores(self, score: FloatArray, recording: IntArray) -> FloatArray:
        """Computes scores over h, less their recording's mean, (segment, window, part)."""
        value = score / self._diagonal
        for index in np.unique(recording):
            in_recording = recording == index
            value[in_recording] -= score[in_recording].sum(axis=(0, 1)) / self._diagonal[
                in_recording
            ].sum(axis=(0, 1))
        return value


@dataclass(frozen=True, kw_only=True, eq=False)
class Variation:
    """Variances of the wind's parts over its squared mean, by neighbouring windows: negative where
    numerics rule.

    Attributes:
        total: (part,) about the mean of the recording.
        fast: (part,) about the mean of the segment.
        error: (part,) standard errors of `total`, by how segments differ; none where they are not
            known.
    """

    total: FloatArray
    fast: FloatArray
    error: FloatArray = field(default_factory=lambda: np.zeros(3))

    @property
    def turbulent(self) -> bool:
        """Whether it may be that of turbulence: along the wind, across it as well, and slow."""
        slow = self.total[ALONG] - self.fast[ALONG]
        return bool(
            self.total[ALONG] > 0
            and self.total[LEFT] >= CRITERIA.least_turned**2 * self.total[ALONG]
            and self.fast[ALONG] <= CRITERIA.most_within * slow
        )

    @property
    def alone(self) -> bool:
        """Whether the wind varies along itself alone, however fast, and beyond what chance may
        hide: neither turbulence nor an obstacle does so."""
        across = max(float(self.total[LEFT]), 0.0) + CRITERIA.reach * float(self.error[LEFT])
        return bool(
            self.total[ALONG] > 0 and across < CRITERIA.least_obstructed**2 * self.total[ALONG]
        )

    @property
    def words(self) -> str:
        """How it differs from turbulence's."""
        if self.total[ALONG] <= 0:
            return "the wind does not vary along its mean as it does in turbulence"
        turned = math.sqrt(max(self.total[LEFT], 0.0) / self.total[ALONG])
        if turned < CRITERIA.least_turned:
            return (
                f"the wind varies across its mean by {turned:.2g} of what it does along it, in "
                "turbulence 0.6 to 1"
            )
        return (
            "the wind varies faster than turbulence does: more within two seconds than between "
            "stretches of two seconds"
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Gauge:
    """What courses are taken along, kept: of other models' errors they are taken along the same.

    Attributes:
        moved: (segment, part, frame, marker · 3) sensitivities over the errors' scale.
        window: frames.
    """

    moved: Tensor
    window: int

    @classmethod
    def of(cls, changes: Sequence[Tensor], scale: Tensor, *, period: float) -> Gauge:
        """Makes a gauge along the sensitivities of `winds`.

        Args:
            changes: (frame, marker, 3, segment) each [m per unit].
            scale: (marker, segment) of the errors [m].
            period: between the frames [s].
        """
        moved = torch.stack([change / scale[None, :, None] for change in changes])
        window = max(1, min(round(_WINDOW / period), moved.shape[1] // 2))
        return cls(moved=moved.permute(4, 0, 1, 2, 3).flatten(3), window=window)

    def course(self, errors: Tensor) -> Course:
        """Computes the course by errors (segment, frame, marker · 3) over their scale."""
        score = torch.einsum("spfk,sfk->sfp", self.moved, errors.to(self.moved))
        curvature = torch.einsum("spfk,sqfk->sfpq", self.moved, self.moved)
        return Course(score=self._windows(score), curvature=self._windows(curvature))

    def _windows(self, values: Tensor) -> FloatArray:
        """Sums (segment, frame, …) over windows, (segment, window, …); frames beyond the last whole
        window are left out."""
        count = values.shape[1] // self.window
        windows = values[:, : count * self.window].unflatten(1, (count, self.window))
        return windows.sum(2).double().cpu().numpy()

    @classmethod
    def joined(cls, parts: Sequence[Gauge]) -> Gauge:
        """Joins the segments of several gauges, one after another."""
        return cls(moved=torch.cat([p.moved for p in parts]), window=parts[0].window)
