"""What the program drafted from a log's own text counts only when somebody confirmed it.

A format that recognised its file, a recipe that the user gave, and a table that states time, unit
and quantity itself need no question. Any other reading is a draft: it is shown, and confirmed at a
terminal, by the hash of what was shown, or replaced by a recipe.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar

from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical, digest
from flagdata.core.shell import command_line
from flagdata.errors import ErrorKind, RefusedError
from flagdata.ingest.anemometer.wind_options import WindOptions
from flagdata.record.signals import WindLog
from flagdata.timebase import iso

T = TypeVar("T")
Answers = Mapping[str, object]
"""Fields of `WindOptions` that were typed, by name."""
_HASH = 16
_WIDE = 60
"""Characters of a raw line that a preview shows."""


@dataclass(frozen=True, kw_only=True)
class Drafted:
    """The drafted readings of one file.

    Attributes:
        path: of the file.
        source_hash: of its bytes.
        readings: each anemometer's log, and the options that it was read by.
    """

    path: Path
    source_hash: str
    readings: tuple[tuple[WindLog, WindOptions], ...]

    @property
    def accept(self) -> str:
        """Hash of the file's bytes, of what was drafted and of what the user answered."""
        content = {
            "source": self.source_hash,
            "drafts": [
                [log.drafted, dict(log.plan), json_values(options)]
                for log, options in self.readings
            ],
        }
        return digest(canonical(content))[:_HASH]

    def sentences(self) -> tuple[str, ...]:
        """Describes one row of each reading in a sentence."""
        several = len(self.readings) > 1
        return tuple(
            _sentence(log, f" at {log.series.sensor.name!r}" if several else "")
            for log, _ in self.readings
        )

    def preview(self) -> str:
        """Shows how the file was understood: reasons, rows beside what was read of them,
        findings."""
        lines = [f"{self.path.name} is a table that no recipe describes. This is how it is read:"]
        for number, (log, _) in enumerate(self.readings, start=1):
            if len(self.readings) > 1:
                lines.append(
                    f"anemometer {number} of {len(self.readings)}: {log.series.sensor.name}"
                )
            lines += [f"  {reason}" for reason in log.reasons]
            for row in log.rows:
                lines.append(
                    f"    line {row.line}  {row.text[:_WIDE]}  →  {iso(row.time)}  {row.wind}"
                )
            series = log.series
            lines.append(
                f"  {len(series)} rows from {iso(int(series.time[0]))} to "
                f"{iso(int(series.time[-1]))}"
            )
            for finding in log.findings:
                lines.append(
                    f"  {finding.severity}: "
                    f"{finding.what}{f'; {finding.fix}' if finding.fix else ''}"
                )
        return "\n".join(lines)


class UnconfirmedError(RefusedError):
    """A reading that the program drafted, and that nobody has confirmed."""

    kind = ErrorKind.UNCONFIRMED
    JSON_NAMES = (*RefusedError.JSON_NAMES, "accept", "preview")

    def __init__(
        self, what: str, *, where: str | None = None, fix: str, accept: str = "", preview: str = ""
    ) -> None:
        super().__init__(what, where=where, fix=fix)
        self.accept = accept
        self.preview = preview

    @classmethod
    def of(cls, drafted: Drafted) -> UnconfirmedError:
        """Returns the error for some drafted readings, with both ways out."""
        return cls(
            "parts of how this file is read are inferred or assumed, and nobody has confirmed them",
            where=str(drafted.path),
            accept=drafted.accept,
            preview=drafted.preview(),
            fix="compare the rows above with what you know of the wind; if they are right, repeat "
            "the command with "
            f"{command_line('--accept', drafted.accept)}; if not, describe the file by a recipe: "
            "--sensor FILE.toml "
            "(flagdata ingest --sniff prints a recipe to begin with)",
        )


class Confirm(Protocol):
    """Asks, by whichever means, what a file leaves open, and whether drafted readings are right."""

    @property
    def accept(self) -> str | None:
        """The hash that was given, if one was."""
        ...

    def answered(self, read: Callable[[Answers], T]) -> T:
        """Calls `read` with answers to all that the file leaves open, at first with none, and
        returns what it gives.

        Raises:
            ZoneMissingError, OpenFactsError: there is nobody to ask.
        """
        ...

    def __call__(self, drafted: Drafted) -> str:
        """Returns how the readings were confirmed, for the report. Raises UnconfirmedError where
        they were not."""
        ...


@dataclass(frozen=True)
class Accepting:
    """Confirms the readings whose hash was given, and no others.

    Attributes:
        accept: see `Drafted.accept`; `None` confirms nothing.
    """

    accept: str | None = None

    def answered(self, read: Callable[[Answers], T]) -> T:
        """Reads once, as `Confirm.answered` does, and asks nobody."""
        return read({})

    def __call__(self, drafted: Drafted) -> str:
        if self.accept == drafted.accept:
            return f"accepted as {self.accept}"
        raise UnconfirmedError.of(drafted)


UNASKED = Accepting()
"""Refuses every draft."""


def confirm_readings(
    path: Path, source_hash: str, readings: Sequence[tuple[WindLog, WindOptions]], confirm: Confirm
) -> str | None:
    """Confirms the drafted ones of a file's readings and returns how; `None` where none of them is
    a draft.

    Raises:
        UnconfirmedError: nobody confirmed them.
    """
    drafts = tuple((log, options) for log, options in readings if log.drafted and not log.stated)
    if not drafts:
        return None
    return confirm(Drafted(path=path, source_hash=source_hash, readings=drafts))


def _sentence(log: WindLog, where: str) -> str:
    row = log.rows[0]
    return (
        f"On {iso(row.time)[:10]} at {iso(row.time)[11:].removesuffix('Z')} UTC the wind{where} "
        f"was {row.wind}."
    )
