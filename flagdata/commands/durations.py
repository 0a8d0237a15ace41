"""Lengths of time on the command line: a number and its unit."""

from __future__ import annotations

import re

import click

_SECONDS = {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86_400.0, "day": 86_400.0}
_WRITTEN = re.compile(r"\s*(\d+(?:\.\d*)?|\.\d+)\s*(ms|s|min|h|day|d)\s*")


def written_seconds(text: str) -> float | None:
    """The seconds of a length of time such as 10s, 2min or 1h; None where the text is none, or has no unit."""
    found = _WRITTEN.fullmatch(text)
    return None if found is None else float(found[1]) * _SECONDS[found[2]]


class Duration(click.ParamType):
    """A length of time such as 10s, 2min or 1h, in seconds; a number without a unit is refused."""

    name = "time"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The seconds."""
        if isinstance(value, float):
            return value
        seconds = written_seconds(str(value))
        if seconds is None:
            self.fail(f"{value!r} is not a length of time; give a number and ms, s, min, h or d, e.g. 10s", param, ctx)
        return seconds


DURATION = Duration()
