"""Effects from files as directions of the model: what is tested when a proposal meets new
recordings."""

from __future__ import annotations

from dataclasses import dataclass

from flagdata.errors import UnknownNameError
from measure.forecasting.regressors import EffectColumn, library
from sim.effects import Effect
from sim.effects.effect_files import load


@dataclass(frozen=True, kw_only=True)
class FileColumn(EffectColumn):
    """A strength of an effect of a file.

    Attributes:
        spec: `FILE.py:Class`.
    """

    spec: str

    @property
    def kind(self) -> type[Effect]:
        return load(self.spec)


def from_file(spec: str) -> tuple[FileColumn, ...]:
    """Lists the strengths of the effect that `FILE.py:Class` names, with steps of half their
    expected range.

    Raises:
        FlagdataError: as `sim.effects.effect_files.load`.
    """
    effect = load(spec)
    described = effect.parameters()
    return tuple(
        FileColumn(
            effect=effect.__name__,
            parameter=name,
            spec=spec,
            step=max(described[name].prior, key=lambda end: abs(end - described[name].null)) / 2,
        )
        for name in effect.strengths()
    )


def library_column(name: str) -> EffectColumn:
    """Finds the column of a strength of the library, by "effect.parameter".

    Raises:
        UnknownNameError: none of that name is weighed.
    """
    by_name = {column.name: column for column in library()}
    if name not in by_name:
        raise UnknownNameError.of("weighed strength", name, by_name)
    return by_name[name]
