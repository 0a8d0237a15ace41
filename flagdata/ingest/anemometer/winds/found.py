"""What a table's columns are found to be: columns for channels, anemometers, and columns by what headings say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.words.headings import Heading

SPEEDS = ("wind_speed", "apparent_wind_speed", "theoretical_wind_speed")
COMPONENTS = ("wind_x", "wind_y", "wind_z")


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column for a channel.

    Attributes:
        index: of the column.
        unit: as `flagdata.units` spells it; `None` where nothing tells it.
        told: how the unit is known.
        towards: of a direction, whether the wind blows to it.
    """

    index: int
    unit: str | None
    told: str
    towards: bool = False


@dataclass(frozen=True, kw_only=True)
class Wind:
    """One anemometer of a table.

    Attributes:
        label: what the user calls it by: the heading of its speed, or of its first component.
        height: above ground [m], where the heading tells.
        columns: by channel.
        sure: whether the heading names the wind; false where only the unit or a lone "speed" speaks for it.
        site: column and text of the rows that are its own, where a table mixes sites.
        of_earth: whether its components are said to be towards east (x) and north (y).
    """

    label: str
    height: float | None
    columns: Mapping[str, Column]
    sure: bool
    site: tuple[int, str] | None = None
    of_earth: bool = False

    def without_unit(self) -> tuple[str, ...]:
        """Channels of the wind's speed whose unit nothing tells."""
        return tuple(name for name in (*SPEEDS, *COMPONENTS) if name in self.columns and not self.columns[name].unit)


@dataclass
class Found:
    """Columns by what their heading says, with numbers in them."""

    layout: Layout
    headings: list[Heading]
    values: dict[int, NDArray[np.float64]] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    of_earth: bool = False

    def of(self, *channels: str) -> list[int]:
        return [index for index in self.values if self.headings[index].channel in channels]

    def key(self, index: int) -> tuple[object, ...]:
        heading = self.headings[index]
        return (*heading.label, heading.height)

    def name(self, index: int) -> str:
        name = self.layout.names[index]
        return f"{name}#{index + 1}" if self.layout.names.count(name) > 1 else name
