"""What surrounds the pictures of a data set, and how well simple classifiers guess parameters from
it alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.record import Record

RIDGE = 1.0
NEIGHBOURS = 15
FOLDS = 40
FEATURES = (
    "order",
    "number in the name",
    "length of the name",
    "size",
    "mean frame",
    "spread of frames",
    "range of frames",
    "mean of the JPEG's header",
    "first quantiser",
    "start of the scan",
    "frames",
    "start within the second",
    "start",
    "wind samples",
)


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """Of all films: features (n, k) as in `FEATURES`, sequence (n,), and the parameters that must
    not be guessed."""

    features: FloatArray
    sequence: IntArray
    parameters: Sequence[Mapping[str, float]]

    def labels(self, targets: Sequence[str]) -> FloatArray:
        """(n, target) 1 where a parameter is above its median, else −1."""
        values = np.array([[film[target] for target in targets] for film in self.parameters])
        return np.where(values > np.median(values, axis=0), 1.0, -1.0)


def features_of(name: str, record: Record, *, order: int, size: int) -> list[float]:
    """What is seen of a film without looking at its pictures.

    Args:
        order: its place in the catalog.
        size: of its object [B].
    """
    jpegs = record.jpegs(0, len(record.frame_times))
    lengths = np.array([len(jpeg) for jpeg in jpegs], dtype=float)
    start, end = (
        jpegs[0].index(b"\xff\xdb"),
        jpegs[0].index(b"\xff\xda"),
    )  # quantisation tables; start of scan
    header = np.frombuffer(jpegs[0][start:end], dtype=np.uint8)
    series = record.wind()
    first = int(record.frame_times[0])
    return [
        float(value)
        for value in (
            order,
            int(name.rpartition("-")[2]),
            len(name),
            size,
            lengths.mean(),
            lengths.std(),
            np.ptp(lengths),
            header.mean(),
            header[5],
            end,
            len(jpegs),
            first % 10**9,
            first,
            0 if series is None else len(series),
        )
    ]


def accuracies(
    features: FloatArray, labels: FloatArray, sequence: IntArray
) -> dict[str, FloatArray]:
    """Share of right guesses (target,) of labels ±1 (film, target), on films of sequences that were
    not fitted to.

    Both labels weigh the same, so that a blind guess is right in half of the cases however often
    each occurs. "ridge" is linear in the features and their squares, "neighbours" the majority of
    the nearest films.
    """
    spread = features.std(axis=0)
    x = (features - features.mean(axis=0))[:, spread > 0] / spread[spread > 0]
    both = np.column_stack([x, x**2, np.ones(len(x))])
    own = np.unique(sequence, return_inverse=True)[1] % FOLDS
    ridge, near = np.empty_like(labels), np.empty_like(labels)
    for fold in np.unique(own):
        held, fitted = own == fold, own != fold
        gram = both[fitted].T @ both[fitted] + RIDGE * np.eye(both.shape[1])
        ridge[held] = both[held] @ np.linalg.solve(gram, both[fitted].T @ labels[fitted])
        away = np.square(x[held][:, None] - x[fitted]).sum(axis=-1)
        nearest = np.argpartition(away, NEIGHBOURS, axis=1)[:, :NEIGHBOURS]
        near[held] = labels[fitted][nearest].mean(axis=1)
    return {"ridge": _right(ridge, labels), "neighbours": _right(near, labels)}


def _right(guesses: FloatArray, labels: FloatArray) -> FloatArray:
    hits = np.sign(guesses) == labels
    shares = [
        (hits & (labels == label)).sum(axis=0) / (labels == label).sum(axis=0) for label in (-1, 1)
    ]
    return (shares[0] + shares[1]) / 2


def dealt_anew(sequence: IntArray, rng: np.random.Generator) -> IntArray:
    """(n,) which film each film's parameters are taken from, when sequences change places with one
    another."""
    films = [np.flatnonzero(sequence == own) for own in np.unique(sequence)]
    taken = np.empty(len(sequence), dtype=np.int64)
    for own, other in enumerate(rng.permutation(len(films)).tolist()):
        taken[films[own]] = np.resize(films[other], len(films[own]))
    return taken
