"""What a linear model reads out of an embedding: PCA, linear regression, one left out at a time,
Pearson's r.

Bouman, Xiao, Battaglia and Freeman, Estimating the material properties of fabric from video, ICCV
2013, as in Runia et al., Cloth in the Wind, CVPR 2020, section 6: r of log stiffness and log area
weight.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.findings import Finding, Severity
from flagdata.errors import InputError
from models.evaluation import SCORES, Resamples, estimate
from models.evaluation.bootstrap import ScoreEstimate

COMPONENTS = 50
"""Principal components the paper keeps."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Readout:
    """Quantities read out of clips by regressions that did not see them.

    Attributes:
        targets: names of t quantities.
        truth, predicted: (n, t).
        pearson: r of each target, with an interval over groups of the predictions made.
        components: how many principal components were kept.
        findings: what a reader of r has to know.
    """

    targets: tuple[str, ...]
    truth: FloatArray
    predicted: FloatArray
    pearson: tuple[ScoreEstimate, ...]
    components: int
    findings: tuple[Finding, ...]


def bouman(
    embedding: NDArray[np.floating],
    quantities: Mapping[str, FloatArray],
    *,
    group: IntArray,
    generator: np.random.Generator,
    components: int = COMPONENTS,
) -> Readout:
    """Reads quantities out of an embedding by the protocol on logarithms of positive quantities,
    usually stiffness and area weight.

    Args:
        embedding: (n, d).
        quantities: (n,) each, positive; SI.
        group: (n,) of what is left out together: `np.arange(n)` leaves out one clip at a time, as
            the paper does; clips of one cloth should share a group, else its twin stays in the
            training set.
        generator: of the bootstrap.
        components: to keep; fewer where the clips do not suffice, which a finding says.

    Raises:
        InputError: fewer than four clips or three groups, a quantity that is not positive or the
            same in all clips, lengths that do not fit.
    """
    for name, values in quantities.items():
        if values.shape != (len(embedding),) or not (np.isfinite(values) & (values > 0)).all():
            raise InputError(
                f"{name} is not a positive number for each of {len(embedding)} clips",
                where="the quantities",
                fix="its logarithm is regressed; leave out clips without a measured value",
            )
        if np.ptp(values) == 0:
            raise InputError(
                f"{name} is the same in all clips",
                where="the quantities",
                fix="a correlation needs cloths that differ",
            )
    truth = np.log(np.column_stack(list(quantities.values())))
    used, findings = _admissible(embedding, group, components)
    predicted = leave_one_group_out(embedding, truth, group=group, components=used)
    resamples = Resamples.of(group, generator=generator)
    pearson = tuple(
        estimate(
            SCORES["pearson"].value(
                resamples.sums(SCORES["pearson"].terms(truth[:, i], predicted[:, i]))
            ),
            name="pearson",
            clips=len(truth),
            groups=resamples.groups,
        )
        for i in range(truth.shape[1])
    )
    return Readout(
        targets=tuple(f"log {name}" for name in quantities),
        truth=truth,
        predicted=predicted,
        pearson=pearson,
        components=used,
        findings=findings,
    )


def _admissible(
    embedding: NDArray[np.floating], group: IntArray, components: int
) -> tuple[int, tuple[Finding, ...]]:
    """Limits components to three fifths of a fold's degrees of freedom, which admits the paper's 50
    components of 90 clips."""
    clips, dimension = embedding.shape
    size = np.unique(group, return_counts=True)[1]
    if clips < 4 or len(size) < 3:
        raise InputError(
            f"{clips} clips of {len(size)} groups are left out one group at a time",
            where="the groups",
            fix="give at least four clips and three groups",
        )
    if components < 1:
        raise InputError(
            f"{components} components are too few", where="components", fix="give at least 1"
        )
    training = clips - int(size.max())
    most = max(1, min(dimension, 3 * (training - 1) // 5))
    if components <= most:
        return components, ()
    reason = (
        f"the embedding has {dimension} dimensions"
        if most == dimension
        else f"{training} clips train a fold"
    )
    text = f"{most} principal components are kept, not {components}: {reason}"
    fewer = Finding(
        kind="fewer-components", severity=Severity.WARNING, what=text, value=float(most)
    )
    return most, (fewer,)


def leave_one_group_out(
    embedding: NDArray[np.floating], truth: FloatArray, *, group: IntArray, components: int
) -> FloatArray:
    """Predicts (n, t) for each group by principal component regression on all others.

    PCA and regression are both fitted without the group. The other groups' scatter and cross
    moments are the whole's less the group's own (a closed form, exact), so a fold costs one
    eigenvalue problem of min(n - 1, d) rows. Coordinates are first turned into the embedding's own
    row space, which loses nothing and changes no PCA.

    Args:
        embedding: (n, d).
        truth: (n, t).
        group: (n,).
        components: of the PCA; directions without variance in a fold are not used.
    """
    centred = embedding.astype(np.float64) - embedding.mean(axis=0, dtype=np.float64)
    coordinates, singular, _ = np.linalg.svd(centred, full_matrices=False)
    rank = max(1, int((singular > singular[0] * 1e-10).sum())) if singular.size else 0
    points = coordinates[:, :rank] * singular[:rank]
    offset = truth.mean(axis=0)
    values = truth - offset
    scatter, cross = points.T @ points, points.T @ values
    predicted = np.empty_like(truth)
    for label in np.unique(group):
        inside = group == label
        left_out, count = points[inside], len(points) - int(inside.sum())
        mean, level = -left_out.sum(axis=0) / count, -values[inside].sum(axis=0) / count
        fold = scatter - left_out.T @ left_out - count * np.outer(mean, mean)
        moments = cross - left_out.T @ values[inside] - count * np.outer(mean, level)
        variance, directions = np.linalg.eigh(fold)
        used = slice(max(0, rank - components), rank)
        enough = variance[used] > variance[-1] * 1e-10
        axes = directions[:, used][:, enough]
        slope = (axes.T @ moments) / variance[used][enough][:, None]
        predicted[inside] = offset + level + (left_out - mean) @ axes @ slope
    return predicted
