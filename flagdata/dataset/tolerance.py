"""How uncertain a pair may be, and which pairs are refused for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flagdata.dataset.pair_table import PairTable
from flagdata.dataset.truth import LOW_COVERAGE, STALE
from flagdata.errors import UsageError


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """How uncertain a pair may be. A pair outside is refused with the reason, never filled in.

    Attributes:
        clock_sigma: of the camera's clock on the wind's, at most [s].
        staleness: age of the newest wind sample at the clip's end, at most [s].
        coverage: share of the window that wind samples speak for, at least.

    Raises:
        UsageError: a bound that is not a number of its kind.
    """

    clock_sigma: float = 1.0
    staleness: float = STALE
    coverage: float = LOW_COVERAGE

    def __post_init__(self) -> None:
        if not (self.clock_sigma >= 0 and self.staleness >= 0 and 0 <= self.coverage <= 1):
            raise UsageError(
                f"{self} is out of bounds",
                fix="give σ and staleness of 0 s or more, and a coverage between 0 and 1",
            )


@dataclass(frozen=True, kw_only=True)
class Refusal:
    """A pair that was refused, and every reason for it."""

    artifact: str
    recording: str
    reasons: tuple[str, ...]


def judge(
    table: PairTable, tolerance: Tolerance, *, superseded: Mapping[str, str]
) -> dict[int, Refusal]:
    """Refusals by the pair's index.

    Args:
        superseded: recording → the one that replaces it.
    """
    checks = (
        (
            np.isin(table.recording, np.array(sorted(superseded), dtype=np.str_)),
            lambda k: (
                f"recording {superseded[str(table.recording[k])]} aligned the same camera and wind "
                "later"
            ),
        ),
        (np.isnan(table.wind), lambda k: "no usable wind sample in the window"),
        (
            table.coverage < tolerance.coverage,
            lambda k: (
                f"wind samples cover {table.coverage[k]:.2f} of the window, less than "
                f"{tolerance.coverage:g}"
            ),
        ),
        (
            table.staleness > tolerance.staleness,
            lambda k: (
                f"the newest wind sample is {table.staleness[k]:.3g} s old, above "
                f"{tolerance.staleness:g} s"
            ),
        ),
        (np.isnan(table.clock_sigma), lambda k: "the uncertainty of the camera's clock is unknown"),
        (
            table.clock_sigma > tolerance.clock_sigma,
            lambda k: (
                f"the camera's clock is known to ±{table.clock_sigma[k]:.3g} s, above "
                f"{tolerance.clock_sigma:g} s"
            ),
        ),
        (
            np.isnan(table.wind_sigma) & ~np.isnan(table.wind) & ~np.isnan(table.clock_sigma),
            lambda k: (
                "the uncertainty of the mean wind is unknown: too few wind samples, or a sensor of "
                "unknown accuracy "
                "that always reads the same"
            ),
        ),
    )
    bad = np.any([mask for mask, _ in checks], axis=0)
    return {
        int(k): Refusal(
            artifact=str(table.artifact[k]),
            recording=str(table.recording[k]),
            reasons=tuple(reason(k) for mask, reason in checks if mask[k]),
        )
        for k in np.nonzero(bad)[0]
    }
