"""What a case states before it is measured: the sheet, the air, the camera, which clips and lengths
may be fitted.

It stands in `paper-flag.toml`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from tests.studies.validation.paper_flag.limit_cycle import StripRun
from tests.studies.validation.paper_flag.sheet import Sheet

_TRIED = ("shares", "lifts", "pair_shares", "pair_lifts", "speeds")


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
        shares, lifts, speeds: at which the strip is simulated: M / (ρ L), slopes of the lift
            coefficient, and [m/s] at the sheet; `pair_shares` with each of `pair_lifts` likewise.
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

    def of(self, group: Group) -> tuple[ClipSpec, ...]:
        """Its clips, by rising speed."""
        return tuple(sorted((c for c in self.clips if c.group is group), key=lambda c: c.speed))


def load_case() -> Case:
    """The paper flag, as `paper-flag.toml` states it."""
    top = tomllib.loads(Path(__file__).with_name("paper-flag.toml").read_text(encoding="utf-8"))
    sheet, camera, clips, thresholds = top["sheet"], top["camera"], top["clips"], top["thresholds"]
    simulation = top["simulation"]
    tried = {name: tuple(simulation[name.replace("_", "-")]) for name in _TRIED}
    run = {name: value for name, value in simulation.items() if not isinstance(value, list)}
    return Case(
        name=top["name"],
        about=top["about"],
        seed=top["seed"],
        source=sheet["source"],
        sheet=Sheet(length=sheet["length"], mass=sheet["mass"], rigidity=sheet["rigidity"]),
        density=top["air"]["density"],
        true_rate=camera["true-rate"],
        column_scale=camera["column-scale"],
        row_scale=camera["row-scale"],
        folder=clips["folder"],
        suffix=clips["suffix"],
        clips=tuple(
            ClipSpec(name=name, speed=speed, group=group, whole=name in camera["whole"])
            for group in Group
            for name, speed in clips[group.value].items()
        ),
        tables={key: thresholds[key] for key in ("stop", "onset", "authors", "curve")},
        fit_lengths=tuple(thresholds["fit-lengths"]),
        held_out_lengths=tuple(thresholds["held-out-lengths"]),
        reactive_share=top["declared"]["reactive-share"],
        shear_factor=top["declared"]["shear-factor"],
        run=StripRun(**run),
        **tried,
    )
