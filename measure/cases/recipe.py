"""What is known of a case before it is measured: the sheet, the air, the camera, which clips and lengths may be fitted.

A recipe is TOML in catalogs/cases. Parsed here and nowhere else; unknown keys are refused, the nearest is named.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from math import nan

from flagdata.errors import InputError, LimitError, UnknownNameError
from flagdata.recipes import Shelf, parsed
from flagdata.tables import SEED_LIMIT, Table
from measure.cases.limit_cycle import StripRun
from measure.cases.sheet import Sheet

CASES = Shelf(folder="cases", noun="case")
COLUMNS_LIMIT = 1000
"""Most cells along the strip."""
FRAMES_LIMIT = 1_000_000
"""Most frames of a strip's simulation, those that settle included."""


class Group(StrEnum):
    """What a clip may be used for."""

    FIT = "fit"
    HELD_OUT = "held-out"
    OTHER = "other-sheets"
    """Another sheet: predicted with this one's parameters."""


@dataclass(frozen=True, kw_only=True)
class ClipSpec:
    """One clip.

    Attributes:
        speed: of the tunnel [m/s].
        whole: whether sheet and clamp are in view.
    """

    name: str
    speed: float
    group: Group
    whole: bool


@dataclass(frozen=True, kw_only=True)
class Case:
    """A sheet filmed edge-on in a tunnel.

    Attributes:
        sheet: its length, mass and rigidity, no air.
        source: where the data are from.
        density: of the air [kg/m³].
        true_rate: of the camera [Hz].
        column_scale, row_scale: [m/px] along the stream and across it.
        folder, suffix: where the clips are: folder/NAME + suffix.
        tables: "stop", "onset", "authors", "curve" → path in the data.
        fit_lengths, held_out_lengths: [m].
        reactive_share: declared M / (ρ L).
        shear_factor: declared speed at the sheet over the tunnel's.
        shares, lifts, speeds: at which the strip is simulated: M / (ρ L), slopes of the lift coefficient, and [m/s] at
            the sheet; `pair_shares` with each of `pair_lifts` likewise.
    """

    name: str
    about: str
    seed: int
    sheet: Sheet
    source: str
    density: float
    true_rate: float
    column_scale: float
    row_scale: float
    folder: str
    suffix: str
    clips: tuple[ClipSpec, ...]
    tables: Mapping[str, str]
    fit_lengths: tuple[float, ...]
    held_out_lengths: tuple[float, ...]
    reactive_share: float
    shear_factor: float
    shares: tuple[float, ...]
    lifts: tuple[float, ...]
    pair_shares: tuple[float, ...]
    pair_lifts: tuple[float, ...]
    speeds: tuple[float, ...]
    run: StripRun

    def __post_init__(self) -> None:
        shared = set(self.fit_lengths) & set(self.held_out_lengths)
        if shared:
            raise InputError(
                f"length {min(shared):g} m is both fitted and held out", where=self.name, fix="give it to one of them"
            )
        names = [clip.name for clip in self.clips]
        if len(set(names)) != len(names):
            raise InputError("a clip is in two groups", where=self.name, fix="give it to one of them")

    def of(self, group: Group) -> tuple[ClipSpec, ...]:
        """Its clips, by rising speed."""
        return tuple(sorted((c for c in self.clips if c.group is group), key=lambda c: c.speed))


def load_case(source: str) -> Case:
    """The case of that name in the catalog, or of a `.toml` file.

    Raises:
        NotFoundError: no such file.
        UnknownNameError: no such case, or a key that is not known.
        InputError: a value that does not fit.
    """
    found = CASES.find(source)
    return parse_case(found.text, where=found.where)


def parse_case(text: str, *, where: str) -> Case:
    """A case of TOML text.

    Raises:
        UnknownNameError, InputError: as `load_case`.
    """
    top = Table(parsed(text, where=where), where=where)
    sheet, air, camera = top.table("sheet"), top.table("air"), top.table("camera")
    clips, thresholds, declared = top.table("clips"), top.table("thresholds"), top.table("declared")
    simulation = top.table("simulation")
    whole = camera.texts("whole")
    specs: list[ClipSpec] = []
    for group in Group:
        table = clips.table(group.value)
        specs += [
            ClipSpec(name=n, speed=table.number(n, nan, above=0), group=group, whole=n in whole) for n in table.names()
        ]
    case = Case(
        name=top.text("name", where) or where,
        about=top.text("about", "") or "",
        seed=top.whole("seed", 1, least=0, most=SEED_LIMIT),
        sheet=Sheet(
            length=sheet.number("length", nan, above=0),
            mass=sheet.number("mass", nan, above=0),
            rigidity=sheet.number("rigidity", nan, above=0),
        ),
        source=sheet.text("source", "") or "",
        density=air.number("density", nan, above=0),
        true_rate=camera.number("true-rate", nan, above=0),
        column_scale=camera.number("column-scale", nan, above=0),
        row_scale=camera.number("row-scale", nan, above=0),
        folder=clips.text("folder", "") or "",
        suffix=clips.text("suffix", "") or "",
        clips=tuple(specs),
        tables={key: thresholds.text(key, "") or "" for key in ("stop", "onset", "authors", "curve")},
        fit_lengths=thresholds.numbers("fit-lengths"),
        held_out_lengths=thresholds.numbers("held-out-lengths"),
        reactive_share=declared.number("reactive-share", nan, least=0),
        shear_factor=declared.number("shear-factor", nan, above=0),
        shares=simulation.numbers("shares"),
        lifts=simulation.numbers("lifts"),
        pair_shares=simulation.numbers("pair-shares"),
        pair_lifts=simulation.numbers("pair-lifts"),
        speeds=simulation.numbers("speeds"),
        run=StripRun(
            columns=simulation.whole("columns", 24, least=4, most=COLUMNS_LIMIT),
            stretching=simulation.number("stretching", 300.0, above=0),
            settle=simulation.number("settle", 1.0, least=0),
            duration=simulation.number("duration", 1.0, above=0),
        ),
    )
    for table in (sheet, air, camera, clips, thresholds, declared, simulation, top):
        table.done()
    for name in whole:
        if name not in {spec.name for spec in specs}:
            raise UnknownNameError.of("clip", name, [spec.name for spec in specs], where=f"{where} [camera] whole")
    if not any(clip.whole for clip in case.of(Group.HELD_OUT)):
        raise InputError(
            "no clip that is held out shows the whole sheet, and the report needs one", where=f"{where} [camera]",
            fix="name in `whole` a clip of [clips.held-out]",
        )  # fmt: skip
    frames = case.run.rate * (case.run.settle + case.run.duration)
    if frames > FRAMES_LIMIT:
        raise LimitError(
            f"a simulation of {frames:.3g} frames", where=f"{where} [simulation]",
            fix=f"have at most {FRAMES_LIMIT}: shorten settle or duration",
        )  # fmt: skip
    return case
