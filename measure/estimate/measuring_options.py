"""How a film is measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flagdata.core.stated import Stated
from flagdata.errors import UsageError
from measure.film.similarity import POWERS, FlagSize, Sizes
from models.networks.targets import ASPECT
from models.trained.estimator import Estimator
from models.trained.restriction import Known, usable_aspect


@dataclass(frozen=True, kw_only=True)
class Options:
    """How a film is measured.

    Attributes:
        size: of the flag; None if unknown.
        step: from one window to the next [s]; None for windows that follow each other.
        first, last: the part of the film [s]; None for its ends.
        level: of the intervals.
        false_alarm: rate of the gate.
        seed: of all draws.
        refine: simulated clips of a refinement; None for none.
        area_weight: what is stated about the cloth's area weight [kg/m²]; None if it is unknown.

    Raises:
        UsageError: a refinement of a flag whose size is not known.
    """

    size: FlagSize | None = None
    step: float | None = None
    first: float | None = None
    last: float | None = None
    level: float = 0.9
    false_alarm: float = 0.05
    seed: int = 0
    refine: int | None = None
    area_weight: Stated | None = None

    def __post_init__(self) -> None:
        if self.refine is not None and self.size is None:
            raise UsageError(
                "a refinement simulates the flag, whose size is not known",
                fix="give --flag-size, length along the wind times height, as in 1.5x1.0",
            )

    def recipe(self) -> dict[str, Any]:
        """Returns JSON values."""
        return {
            "flag_size": None if self.size is None else [self.size.length, self.size.height],
            "step": self.step,
            "first": self.first,
            "last": self.last,
            "level": self.level,
            "false_alarm": self.false_alarm,
            "refine": self.refine,
            "area_weight": None if self.area_weight is None else self.area_weight.recipe(),
        }

    def stated(self, model: Estimator) -> Mapping[str, Stated]:
        """Returns what is stated about quantities, by name: the area weight, and for a model that
        estimates a flag's aspect that of the stated size, where the model knows it."""
        stated_values = {} if self.area_weight is None else {"area_weight": self.area_weight}
        if self.size is not None and (
            aspect := usable_aspect(model.targets, self.size.length, self.size.height)
        ):
            stated_values[ASPECT] = aspect
        return stated_values

    def known(self, sizes: Sizes, model: Estimator) -> tuple[Known, ...]:
        """Returns the constraints, scaled to the network's flag size, for each candidate size.

        Raises:
            UsageError: a quantity that the model does not estimate, or a statement beyond what it
                knows at any size.
        """
        constraints = []
        for name, stated_value in self.stated(model).items():
            target = next((target for target in model.targets if target.name == name), None)
            if target is None:
                raise UsageError(
                    f"the model {model.name!r} does not estimate an area weight",
                    where="--area-weight",
                    fix="leave it out",
                )
            power = POWERS.get(name, 0.0)  # an aspect has none
            least, most = (end * sizes.scale**power for end in (target.low, target.high))
            if not (
                (least * (1 - 1e-9) <= stated_value.low) & (stated_value.high <= most * (1 + 1e-9))
            ).any():
                raise UsageError(
                    f"an {target.about} of {stated_value.text} {target.unit}; of a flag of this "
                    "size the model knows "
                    f"{least.min():.3g} to {most.max():.3g}",
                    where="--area-weight",
                    fix="give kg/m² within that (100 g/m² is 0.1)"
                    + ("" if sizes.given else ", and --flag-size"),
                )
            scale = sizes.draws if sizes.given is None else sizes.scale[:, None]
            constraints.append(Known(name=name, statement=stated_value, scale=scale**power))
        return tuple(constraints)
