"""Options of `flagdata close-loop` that are about films, and which options belong to one kind of
source alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from flagdata.api.measuring_verbs import LENGTHS, OfFlag
from flagdata.errors import UsageError
from flagdata.verbs.option_types import STATED
from flagdata.verbs.shared_options import FLAG, HOW, TEST, ByNulls
from flagdata.verbs.verb_options import described_fields, option, options, typed_names

if TYPE_CHECKING:
    from flagdata.core.stated import Stated


OF_MARKERS = (
    "draft",
    "winds",
    "axis",
    "north",
    "sensor",
    "zone",
    "accept",
    "density_uncertainty",
    "rate",
    "unit",
    "up",
    "noise",
    "bank",
    "scheduler",
    "most_nulls",
)


OF_BOTH = ("material", "flag_size", "attachment", "clock_offset", "area_weight")
"""Options of films that are about markers and meshes as well."""


@options
class OfFilms(OfFlag):
    """What is stated of films and of tables of observables; see `flagdata calibrate`."""

    flag_size: str | None = option(
        f"{LENGTHS}. Films need it; of markers it is their outline by default.",
        default=None,
        section=FLAG,
        was=("--size",),
        metavar="LxH",
    )
    attachment: str | None = option(  # pyright: ignore[reportIncompatibleVariableOverride]
        "How the cloth is held: at both corners of its hoist, or along all of the hoist; of "
        "markers also top-corners, "
        "or u,v;u,v;… [m]. By default corners, of markers as the source states.",
        default=None,
        section=FLAG,
        was=("--pins",),
    )
    area_weight: Stated | None = option(
        "Of a cloth that was weighed [kg/m²], as in 0.155±0.005; by default that of any flag, of "
        "markers that of the "
        "material, to 30 %.",
        default=None,
        section=FLAG,
        type=STATED,
        metavar="VALUE",
    )
    simulations: int | None = option(
        "Of films: simulated flags of the base model for each recording; by default 64, from three "
        "recordings on 128.",
        default=None,
        section=HOW,
        type=click.IntRange(min=64),
    )


@options
class JudgingFilms(OfFilms, ByNulls):
    """All that a verdict on films takes."""

    material: str | None = option(
        "Nominal material, a name of the catalog; by default the one that the source states. Of "
        "films: what the flag "
        "is made of, as in woven-polyester, knit or camel-ponte-roma; by default any fabric.",
        default=None,
        section=FLAG,
        metavar="NAME",
    )
    suspect: str | None = option(
        "An effect that was suspected before the recordings were looked at, as in lift or "
        "vertical-wind-; it alone is "
        "tested for, in that direction, and seen where it is weaker.",
        default=None,
        section=TEST,
        metavar="EFFECT[+|-]",
    )


def refuse_of_others(chosen: JudgingFilms, *, films: bool) -> None:
    """Refuses options that would be ignored.

    Args:
        films: whether the sources are films or tables of observables.

    Raises:
        UsageError: one of them is on the command line.
    """
    rows = described_fields(type(chosen))
    for name in OF_MARKERS if films else described_fields(OfFilms):
        if name in typed_names(chosen) and name not in OF_BOTH:
            kind = "films and tables of observables" if films else "markers and meshes"
            other_kind = "markers and meshes" if films else "films and tables of observables"
            spelled = rows[name][1].spelling_of(name)
            raise UsageError(
                f"the sources are {kind}",
                where=spelled,
                fix=f"leave it out: it is about {other_kind}",
            )
