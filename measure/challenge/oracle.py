"""The error that the true model would have had, with the fitter's own numerics: what E_red is measured against."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from measure.challenge.folder import ChallengeFolder
from measure.challenge.key import Key
from measure.challenge.recipe import effect_type
from sim.effects.gusts import Gusts


class Oracle(Protocol):
    """Knows the truth."""

    def __call__(self, folder: ChallengeFolder, key: Key, /) -> Mapping[str, float]:
        """Comparison, in the verdict's words → root mean square prediction error [m]; empty where it has none."""
        ...


def true_model(folder: ChallengeFolder, key: Key) -> Mapping[str, float]:
    """By predicting with the true cloth and effects; empty with gusts, whose course is in no model.

    Raises:
        InputError: recordings that the fitter cannot use.
    """
    from measure.loop.columns import Calibration
    from measure.loop.oracle import oracle

    kinds = [(effect_type(acting.effect), acting) for acting in key.effects]
    if any(issubclass(kind, Gusts) for kind, _ in kinds):
        return {}
    effects = [kind(**{acting.parameter: acting.value}) for kind, acting in kinds]
    calibration = Calibration(density=key.density, bending=key.bending, damping=key.damping)
    return oracle(folder.experiment(key.name), calibration, effects)
