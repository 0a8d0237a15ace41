"""The gate: what simulated clips score on every check, and the verdict on a clip beside them.

Every check is a score of which high values are suspicious: the image statistics of `checks`, the
distance of the network's summary, how far the summary moves under changes that leave the physics as
it is, the distance of all features together, and a log-likelihood ratio for each distortion of
`distortions` (arXiv 2412.15100). Each is expressed on one scale by its tail over simulated clips
(`tails`); the joint score is the largest of them, and the joint score alone is calibrated, on clips
that shaped no check. So the stated false-alarm rate is that of all checks together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from measure.gate.checks import CHECKS
from measure.gate.distortions import DISTORTIONS
from measure.gate.gate_features import MOVES
from measure.gate.tail_probability import ExponentialTails
from models.trained.outliers import conformal_p, shrunk_covariance, whitening

_SIDED = tuple(
    (name, column, sign, kind)
    for column, (name, check) in enumerate(CHECKS.items())
    for sign, kind in ((1.0, check.high), (-1.0, check.low))
    if kind is not None
)
"""Name, column, sign and reason of each suspicious direction."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """What a score is.

    Attributes:
        name: of the check, of the distance, or "like-" and the distortion's.
        reason: kind of `measure.gate.reasons` that a high value speaks for.
        sign: −1 where the statistic itself is suspicious when low.
        what: the figure in words.
    """

    name: str
    reason: str
    sign: float
    what: str


SCORES: tuple[Score, ...] = (
    *(
        Score(name=name, reason=kind, sign=sign, what=CHECKS[name].what)
        for name, _, sign, kind in _SIDED
    ),
    Score(
        name="summary",
        reason="unlike-cloth",
        sign=1.0,
        what="distance of the network's summary, log10",
    ),
    *(
        Score(
            name=move,
            reason="unlike-cloth",
            sign=1.0,
            what=f"change of the network's summary when {move}, log10",
        )
        for move in MOVES
    ),
    Score(
        name="all-features",
        reason="unlike-cloth",
        sign=1.0,
        what="distance of all features together",
    ),
    *(
        Score(
            name=f"like-{name}",
            reason=distortion.reason,
            sign=1.0,
            what=f"log-likelihood ratio of a clip made {name!r} to a plain one",
        )
        for name, distortion in DISTORTIONS.items()
    ),
)
"""All scores in their order."""

_RESOLUTION = np.array(
    [
        *(CHECKS[name].resolution for name, *_ in _SIDED),
        0.02,
        *(0.05 for _ in MOVES),
        0.2,
        *(0.5 for _ in DISTORTIONS),
    ]
)
_LEARNING = 0.6
"""Share of the plain clips of the fit that covariances are learned from; the others give the tails.
More estimate directions better and leave fewer clips for the tails."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Gate:
    """Statistics of simulated clips.

    Attributes:
        centre, scale: (f,) median and spread of each feature over plain clips.
        whitening: (f, f), of the standardised features of plain clips.
        directions, offsets: (k, f) and (k,): log-likelihood ratio of distortion k = directions · z
            − offset.
        tails: of all scores.
        calibration: (n,) ascending joint scores of the calibration clips.
        statistics: (n, len(CHECKS)) of the calibration clips.
    """

    centre: FloatArray
    scale: FloatArray
    whitening: FloatArray
    directions: FloatArray
    offsets: FloatArray
    tails: ExponentialTails
    calibration: FloatArray
    statistics: FloatArray

    @classmethod
    def of(
        cls, plain: FloatArray, distorted: Mapping[str, FloatArray], calibration: FloatArray
    ) -> Gate:
        """Learns the gate from feature vectors (see `Features.vector`).

        Args:
            plain: (n, f) of simulated clips, one of a simulation, from the training side.
            distorted: name of `DISTORTIONS` → (m, f) of clips of other simulations.
            calibration: (k, f) of simulated clips that are in none of these and that the network
                was not trained on.

        Raises:
            InputError: distortions that are missing, or too few clips.
        """
        missing = DISTORTIONS.keys() - distorted.keys()
        if missing:
            raise InputError(
                f"there are no clips of {', '.join(sorted(missing))}",
                fix="make them by measure.gate.distortions",
            )
        # Centre and scale of each feature, robust, by one part of the plain clips.
        learned = round(_LEARNING * len(plain))
        first, rest = plain[:learned], plain[learned:]
        low, centre, high = np.quantile(first, (0.25, 0.5, 0.75), axis=0)
        scale = np.maximum((high - low) / 1.349, 0.2 * first.std(axis=0)) + 1e-3
        z = squash_tails(first, centre, scale)
        # For each distortion the linear discriminant between it and plain clips.
        directions, offsets = [], []
        z_centred = z - z.mean(axis=0)
        for name in DISTORTIONS:
            z_distorted = squash_tails(distorted[name], centre, scale)
            pooled, _ = shrunk_covariance(
                np.concatenate([z_centred, z_distorted - z_distorted.mean(axis=0)])
            )
            direction = np.linalg.solve(pooled, z_distorted.mean(axis=0) - z.mean(axis=0))
            directions.append(direction)
            offsets.append(direction @ (z_distorted.mean(axis=0) + z.mean(axis=0)) / 2)
        blank = ExponentialTails(start=np.zeros(len(SCORES)), excess=np.ones(len(SCORES)))
        gate = cls(
            centre=centre,
            scale=scale,
            whitening=whitening(shrunk_covariance(z)[0], least=1e-9),
            directions=np.array(directions),
            offsets=np.array(offsets),
            tails=blank,
            calibration=np.zeros(0),
            statistics=calibration[:, : len(CHECKS)],
        )
        return gate._calibrate_thresholds(rest, calibration)

    def _calibrate_thresholds(self, rest: FloatArray, calibration: FloatArray) -> Gate:
        gate = replace(self, tails=ExponentialTails.of(self.scores(rest), _RESOLUTION))
        return replace(gate, calibration=np.sort(gate.surprises(calibration).max(axis=1)))

    def scores(self, vectors: FloatArray) -> FloatArray:
        """Computes scores (n, len(SCORES)) of feature vectors (n, f); high is suspicious."""
        z = squash_tails(vectors, self.centre, self.scale)
        sided = np.stack([sign * vectors[:, index] for _, index, sign, _ in _SIDED], axis=1)
        distances = vectors[:, -1 - len(MOVES) :]
        everything = np.log10(np.linalg.norm(z @ self.whitening.T, axis=1, keepdims=True)) * 10
        return np.concatenate(
            [sided, distances, everything, z @ self.directions.T - self.offsets], axis=1
        )

    def surprises(self, vectors: FloatArray) -> FloatArray:
        """Computes the scores (n, len(SCORES)) of feature vectors (n, f) on the scale of their
        tails."""
        return self.tails.surprise(self.scores(vectors))

    def p_value(self, surprise: float) -> float:
        """Returns the conformal p of a clip whose largest surprise is this."""
        return float(conformal_p(self.calibration, surprise))


def squash_tails(vectors: FloatArray, centre: FloatArray, scale: FloatArray) -> FloatArray:
    """Standardises feature vectors (n, f) and draws in their far tails as a logarithm does:
    asinh."""
    return np.arcsinh((vectors - centre) / scale)
