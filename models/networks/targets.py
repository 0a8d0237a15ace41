"""What networks estimate from a clip: physical parameters, their ranges, and their encoding for
training.

Each target lies in a range, for flags that of the search space of Runia et al. 2020 (table 1), or a
wider one of flags of any fabric. What networks learn is the logit of its place in that range,
widened by 1 % so that the ends stay finite: a distribution over it has no mass outside of what was
simulated, and a uniform prior becomes a logistic one.

A quantity has one name in all tables ("area_weight"), whatever cloth it is of; the range is that of
one kind of cloth. A recipe therefore names targets by the keys of `TARGETS`: "area_weight" is a
flag's in the paper's range, "fabric_area_weight" a flag's of any fabric, "world_area_weight" one's
in a wider range still, "cloth_area_weight" a hanging cloth's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError, UnknownNameError

_MARGIN = 0.005
"""Share of the range that is added at each end."""


class Cloth(StrEnum):
    """What kind of cloth a range is of."""

    FLAG = "flag"
    """3:2, 1.5 m long, held at its hoist."""
    HANGING = "hanging-cloth"
    """1 m × 1 m, held at its two upper corners."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """A quantity that networks estimate.

    Attributes:
        name: of the quantity, as in tables.
        unit: SI.
        low, high: of the search space.
        about: in words.
        digits: that are shown behind the point.
        cloth: whose range it is.
    """

    name: str
    unit: str
    low: float
    high: float
    about: str
    digits: int = 2
    cloth: Cloth = Cloth.FLAG


_OF_FLAGS = {
    target.name: target
    for target in (
        Target(name="wind_speed", unit="m/s", low=0.0, high=10.0, about="wind speed"),
        Target(
            name="area_weight", unit="kg/m²", low=0.10, high=0.17, about="area weight", digits=3
        ),
        Target(
            name="bending_scale",
            unit="log10(N·m)",
            low=-4.6,
            high=-3.25,
            about="mean of the logarithms of the 15 bending coefficients",
        ),
        Target(
            name="anisotropy",
            unit="1",
            low=-1.8,
            high=1.8,
            about="mean logarithm (base 10) of the 5 coefficients along the warp less that of the "
            "5 along the weft",
        ),
    )
}
"""The ranges of wind and area weight are the paper's. With each of 15 factors drawn uniformly from
0.1 to 10 about Camel Ponte Roma's entries, the bending scale has mean -3.93 and standard deviation
0.10, the anisotropy 0.15 and 0.25; the ranges reach at least 6 of them either way."""

_OF_FLAGS_OF_ANY_FABRIC = {
    "fabric_area_weight": Target(
        name="area_weight", unit="kg/m²", low=0.05, high=0.40, about="area weight", digits=3
    ),
    "fabric_bending": Target(
        name="bending_scale",
        unit="log10(N·m)",
        low=-5.2,
        high=-2.9,
        about="mean of the logarithms of the 15 bending coefficients",
    ),
}
"""Flags of the scene `flag-fabrics`: area weights from spinnaker cloth to denim, and a factor of
0.125 to 4 of all bending coefficients together, which moves the bending scale's mean from -4.8 to
-3.3; the ranges reach 4 of its standard deviations beyond either."""

ASPECT = "log_aspect"
"""The natural logarithm of a flag's length over its height."""

_OF_FLAGS_OUTDOORS = {
    "outdoor_wind": Target(name="wind_speed", unit="m/s", low=0.0, high=16.0, about="wind speed"),
    ASPECT: Target(
        name=ASPECT,
        unit="1",
        low=-0.05,
        high=0.75,
        about="natural logarithm of the length over the height",
    ),
}
"""Flags of the scenes `flag-outdoor` and `flag-outdoor-damped`: winds of up to 16 m/s, and lengths
of 1 to 2 heights, with a margin on either side so that a flag of 1:1 or 2:1 lies well within. Who
knows a flag's size conditions on it."""

_OF_FLAGS_OF_THE_WORLD = {
    "world_area_weight": Target(
        name="area_weight", unit="kg/m²", low=0.03, high=0.65, about="area weight", digits=3
    ),
}
"""Flags of the scenes `flag-world` and `flag-world-damped`, whose weights reach well beyond the
fabrics that are flown: a cloth of 0.38 kg/m² lay at the end of the range of `fabric_area_weight`,
and its wind was read too fast. Their winds, bending and shapes are those outdoors."""

_BENDING = 15
_ROW = 5
_STATED = {
    "wind_speed": ("wind_speed",),
    "area_weight": ("area_weight",),
    ASPECT: ("width", "height"),
}
"""What quantities are made of that are not made of the bending coefficients."""

_OF_HANGING_CLOTH = {
    "cloth_wind": Target(
        name="wind_speed", unit="m/s", low=0.0, high=6.0, about="wind speed", cloth=Cloth.HANGING
    ),
    "cloth_area_weight": Target(
        name="area_weight",
        unit="kg/m²",
        low=0.079,
        high=0.454,
        about="area weight",
        digits=3,
        cloth=Cloth.HANGING,
    ),
    "cloth_bending": Target(
        name="bending_scale",
        unit="log10(N·m)",
        low=-5.1,
        high=-3.4,
        cloth=Cloth.HANGING,
        about="mean of the logarithms of the 15 bending coefficients",
    ),
}
"""Those of the ten materials of Wang et al. 2011 with the factors of the scene
`hanging-cloth-wide`: area weights of 0.113 to 0.324 kg/m² times 0.7 to 1.4, bending scales of -4.76
to -3.78 and 0.30 either way. Its anisotropy is the material's own, one of ten values, and no
target."""

TARGETS = {
    **_OF_FLAGS,
    **_OF_FLAGS_OF_ANY_FABRIC,
    **_OF_FLAGS_OUTDOORS,
    **_OF_FLAGS_OF_THE_WORLD,
    **_OF_HANGING_CLOTH,
}
"""By the names that recipes know them by."""


def truth(parameters: Mapping[str, FloatArray], names: Sequence[str]) -> FloatArray:
    """Computes the targets of clips from their parameters: (n, target), NaN where a clip does not
    know them.

    Args:
        parameters: name → (n,) values, as simulated records state them ("wind_speed",
            "area_weight", "bending.0" …; "width" and "height" of the cloth [m]).
        names: keys of `TARGETS`.

    Raises:
        UnknownNameError: a name that is none.
        InputError: no clip states what a target is made of.
    """
    return np.stack([_target_values(parameters, name) for name in names], axis=1)


def stated_targets(parameters: Mapping[str, FloatArray], names: Sequence[str]) -> tuple[str, ...]:
    """Selects the targets of these names that every clip states; parameters as in `truth`.

    Raises:
        UnknownNameError: a name that is none.
    """
    return tuple(
        name
        for name in names
        if all(key in parameters and np.isfinite(parameters[key]).all() for key in _made_of(name))
    )


def _made_of(name: str) -> tuple[str, ...]:
    """Lists the parameters that a target is made of."""
    if name not in TARGETS:
        raise UnknownNameError.of("target", name, TARGETS)
    return _STATED.get(TARGETS[name].name, tuple(f"bending.{index}" for index in range(_BENDING)))


def _target_values(parameters: Mapping[str, FloatArray], name: str) -> FloatArray:
    needed = _made_of(name)
    quantity = TARGETS[name].name
    missing = [
        key for key in needed if key not in parameters or not np.isfinite(parameters[key]).any()
    ]
    if missing:
        raise InputError(
            f"no clip states its {missing[0]}, which the target {name} is made of",
            where="the clips' parameters",
            fix="train on simulated recordings, or leave the target out",
        )
    if len(needed) == 1:
        return np.asarray(parameters[quantity], dtype=np.float64)
    if quantity == ASPECT:
        return np.log(parameters["width"]) - np.log(parameters["height"])
    logs = np.log10(np.stack([parameters[key] for key in needed]))
    if quantity == "bending_scale":
        return logs.mean(axis=0)
    return logs[:_ROW].mean(axis=0) - logs[-_ROW:].mean(axis=0)


@dataclass(frozen=True, kw_only=True)
class Scaling:
    """Between targets and what is learned.

    Attributes:
        names: keys of `TARGETS`, in the order of the columns; all of one kind of cloth, no quantity
            twice.

    Raises:
        UnknownNameError: a name that is none.
        InputError: targets of several kinds of cloth, or a quantity that is named twice.
    """

    names: tuple[str, ...]

    def __post_init__(self) -> None:
        for name in self.names:
            if name not in TARGETS:
                raise UnknownNameError.of("target", name, TARGETS)
        if len({target.cloth for target in self.targets}) > 1 or len(set(self.quantities)) < len(
            self.names
        ):
            raise InputError(
                f"the targets are {', '.join(self.names)}",
                where="[loss] targets",
                fix="name targets of one kind of cloth, each quantity once: "
                + "; or ".join(
                    ", ".join(key for key, target in TARGETS.items() if target.cloth is cloth)
                    for cloth in Cloth
                ),
            )

    @property
    def targets(self) -> tuple[Target, ...]:
        """What the columns are."""
        return tuple(TARGETS[name] for name in self.names)

    @property
    def quantities(self) -> tuple[str, ...]:
        """What tables call them, whatever cloth they are of."""
        return tuple(target.name for target in self.targets)

    @property
    def bounds(self) -> tuple[Tensor, Tensor]:
        """(target,) lower and upper ends of the widened ranges, float64."""
        low = torch.tensor([TARGETS[name].low for name in self.names], dtype=torch.float64)
        high = torch.tensor([TARGETS[name].high for name in self.names], dtype=torch.float64)
        margin = (high - low) * _MARGIN
        return low - margin, high + margin

    def beyond(self, values: FloatArray) -> tuple[str, ...]:
        """Describes, for each target of which some of the values (n, target) lie beyond its widened
        range, how many and how far.

        A network of these targets can state no such value; NaN lies nowhere.
        """
        low, high = (bound.numpy() for bound in self.bounds)
        texts = []
        for column, (name, target) in enumerate(zip(self.names, self.targets, strict=True)):
            entries = values[:, column]
            count = int(((entries < low[column]) | (entries > high[column])).sum())
            if count:
                texts.append(
                    f"{count} of {len(entries)} clips lie beyond the range of the target {name}, "
                    f"{target.low:g} to "
                    f"{target.high:g} {target.unit}: they reach from {np.nanmin(entries):.4g} to "
                    f"{np.nanmax(entries):.4g}"
                )
        return tuple(texts)

    def check(self, values: FloatArray, *, where: str) -> None:
        """Checks that all values (n, target) that are to be learned lie within their ranges.

        Raises:
            InputError: some do not; it names the range, how many they are, and targets whose range
                is wide enough.
        """
        beyond = self.beyond(values)
        if not beyond:
            return
        wide = [name for name in TARGETS if self._covers(name, values)]
        fix = (
            f"name the target {' or '.join(wide)} in [loss] targets"
            if wide
            else "leave that target out"
        )
        raise InputError(
            "; ".join(beyond),
            where=where,
            fix=f"{fix}, or train on a data set whose values lie within the range",
        )

    def _covers(self, name: str, values: FloatArray) -> bool:
        """Returns whether the target of that name is another one of the same quantity and cloth,
        whose range holds all of the values."""
        wanted = TARGETS[name]
        columns = [
            column
            for column, target in enumerate(self.targets)
            if (target.name, target.cloth) == (wanted.name, wanted.cloth) and name not in self.names
        ]
        ranges = Scaling(names=(name,))
        return any(not ranges.beyond(values[:, [column]]) for column in columns)

    def learned(self, values: Tensor) -> Tensor:
        """Transforms values to (n, target) logits; one outside of its range is taken at its end,
        less a millionth.

        What is trained on is refused before it comes to that, see `check`.
        """
        low, high = self.bounds
        share = (values.double() - low.to(values.device)) / (high - low).to(values.device)
        return torch.logit(share, eps=1e-6).float()

    def values(self, learned: Tensor) -> Tensor:
        """Transforms logits to (…, target) values."""
        low, high = (bound.to(device=learned.device, dtype=learned.dtype) for bound in self.bounds)
        return low + (high - low) * learned.sigmoid()

    @property
    def spread(self) -> tuple[float, ...]:
        """(target,) standard deviation of a uniform distribution over each range, to state errors
        against."""
        return tuple(
            (TARGETS[name].high - TARGETS[name].low) / math.sqrt(12) for name in self.names
        )
