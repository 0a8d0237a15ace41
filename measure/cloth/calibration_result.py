"""What a calibration finds: the cloth of a flag, and how each recording compares with simulated
flags of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from flagdata.answer import Quantity
from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.core.findings import Finding
from flagdata.core.json_values import json_values
from flagdata.core.stated import Stated
from measure.cloth.cloth_posterior import Posterior
from measure.cloth.design import CalibrationOptions
from measure.cloth.flag_prior import CLOTH
from measure.cloth.flag_simulation import OBSERVED
from measure.cloth.observed_recording import Observed

_UNLIKE = 0.01
"""Tail probability of a recording's summary among those that the answer predicts below which the
weight is withheld: of recordings that are as the model has them one in a hundred. Higher withholds
more weights of flags that are as the model has them."""
_APART = 2.0
"""σ from which on a summary is named as what is unlike."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """What the same procedure says of simulations that it was not fitted to.

    Attributes:
        count: of them.
        held: of them, those whose area weight lies in its interval.
        median_error: of its value, as a share.
    """

    count: int
    held: int
    median_error: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Fitted:
    """A recording with what simulations of the answer look like.

    Attributes:
        observed: the recording.
        low, middle, high: (window, observable) of simulated flags of the posterior at the level, by
            the emulator.
        used: (observable,) those whose mean or slope the answer rests on.
        misfit: tail probability of its summary among those that the answer predicts.
        deviations: (2·observable,) summaries less those that the answer predicts, in their standard
            deviations.
        failed: simulations that diverged or hardly show the flag.
        place: gain, azimuth and elevation by their names.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "name=observed.name",
        "source=observed.source",
        "windows",
        "wind_speed",
        "misfit",
        "failed",
        "observables",
        "place",
    )

    observed: Observed
    low: FloatArray
    middle: FloatArray
    high: FloatArray
    used: BoolArray
    misfit: float
    deviations: FloatArray
    failed: int
    place: Mapping[str, Quantity]

    @property
    def windows(self) -> int:
        """How many there are."""
        return len(self.observed.readings)

    @property
    def wind_speed(self) -> float:
        """The log's mean over all windows [m/s]."""
        return float(self.observed.speed.mean())

    @property
    def observables(self) -> tuple[str, ...]:
        """Names of those that the answer rests on."""
        return tuple(name for name, used in zip(OBSERVED, self.used, strict=True) if used)

    @property
    def unlike(self) -> str | None:
        """Returns what no simulated flag shows, in words; None where some look like it."""
        if self.misfit >= _UNLIKE:
            return None
        names = [*OBSERVED, *(f"the change of {name} with the wind" for name in OBSERVED)]
        order = np.argsort(-np.abs(np.nan_to_num(self.deviations)))
        distant = [
            (names[column], float(self.deviations[column]))
            for column in order.tolist()
            if abs(self.deviations[column]) > _APART
        ]
        if not distant:
            return "its observables together"
        return ", ".join(
            f"{name} {abs(z):.1f} σ too {'large' if z > 0 else 'small'}" for name, z in distant[:4]
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration:
    """The answer.

    Attributes:
        options: how it was calibrated.
        draws: of the posterior.
        cloth: area weight, bending and damping by their names.
        recordings: in order.
        check: on simulations left out.
        findings: what a reader has to know.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "sentence",
        "cloth",
        "recordings",
        "area_weight_stated",
        "withheld",
        "close_loop",
        "check",
        "level",
        "findings",
    )

    options: CalibrationOptions
    draws: Posterior
    cloth: Mapping[str, Quantity]
    recordings: tuple[Fitted, ...]
    check: Check
    findings: tuple[Finding, ...] = field(default_factory=tuple)

    @property
    def weight(self) -> Quantity:
        """Returns the area weight."""
        return self.cloth[CLOTH[0].name]

    @property
    def level(self) -> float:
        """Returns the level of the intervals."""
        return self.options.level

    @property
    def windows(self) -> int:
        """Returns how many windows all recordings have."""
        return sum(recording.windows for recording in self.recordings)

    @property
    def withheld(self) -> str | None:
        """Returns why no value is given, where no simulated flag looks like a recording."""
        return next(
            (
                f"{recording.observed.name}: {recording.unlike}"
                for recording in self.recordings
                if recording.unlike is not None
            ),
            None,
        )

    @property
    def stated(self) -> Stated | None:
        """Returns the area weight as users state it, to four digits; None where it is not
        determined or a bound."""
        weight = self.weight
        if weight.value is None or weight.sigma is None:
            return None
        value = float(f"{weight.value:.4g}")
        return Stated(low=value, high=value, sigma=float(f"{weight.sigma:.2g}"))

    @property
    def area_weight_stated(self) -> str | None:
        """Returns the same as `flagdata measure --area-weight` takes it."""
        return None if self.stated is None else self.stated.text

    @property
    def close_loop(self) -> Mapping[str, str] | None:
        """Returns what a recipe of `flagdata close-loop` takes of the answer."""
        stated = self.area_weight_stated
        return None if stated is None else {"area-weight": stated}

    @property
    def document(self) -> dict[str, Any]:
        """Returns everything as JSON values, as `flagdata calibrate --json` writes it."""
        return {**json_values(self), "options": self.options.recipe()}

    @property
    def weighs(self) -> bool:
        """Returns whether anything is given of the area weight: a value or a bound."""
        return self.withheld is None and self.weight.constrained

    @property
    def sentence(self) -> str:
        """Returns the answer in words."""
        weight = self.weight
        level = f"{self.options.level * 100:.3g} %"
        windows = self.windows
        if self.withheld is not None:
            return f"area weight: withheld, since no simulated flag looks like {self.withheld}"
        if weight.is_bound:
            low, high = CLOTH[0].ends or weight.interval
            bound = f"{weight.span.phrase(3, ' kg/m²')}, {weight.span.percent}"
            return (
                f"area weight {bound}, n = {windows} windows (assumed: {low:.3f} to {high:.3f} "
                "kg/m²)"
            )
        if weight.value is None:
            low, high = weight.assumed or weight.interval
            return (
                f"area weight: not determined by {windows} windows (assumed: {low:.3f} to "
                f"{high:.3f} kg/m²)"
            )
        low, high = weight.interval
        return (
            f"area weight {weight.value:.3f} kg/m² [{low:.3f}, {high:.3f}] {level}, n = {windows} "
            "windows"
        )
