"""Values of the command line that are more than a text or a number: lengths of time, stated
numbers, shares."""

from __future__ import annotations

import re

import click

from flagdata.core.stated import Stated, parse
from flagdata.errors import UsageError

_SECONDS = {
    "ms": 1e-3,
    "s": 1.0,
    "m": 60.0,
    "min": 60.0,
    "h": 3600.0,
    "d": 86_400.0,
    "day": 86_400.0,
}
_CENTURY = 36_525 * 86_400.0  # s
_WRITTEN = re.compile(r"\s*(\d+(?:\.\d*)?|\.\d+)\s*(ms|s|min|m|h|day|d)\s*")


def written_seconds(text: str) -> float | None:
    """Returns the seconds of a length of time such as 10s, 2min or 1h; None where the text is none,
    or has no unit."""
    found = _WRITTEN.fullmatch(text)
    return None if found is None else float(found[1]) * _SECONDS[found[2]]


class Duration(click.ParamType):
    """A length of time such as 10s, 2min or 1h, in seconds; a number without a unit is refused."""

    name = "time"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Returns the seconds."""
        if isinstance(value, float):
            return value
        seconds = written_seconds(str(value))
        if seconds is None:
            self.fail(
                f"{value!r} is not a length of time; give a number and ms, s, min, h or d, e.g. "
                "10s",
                param,
                ctx,
            )
        if seconds > _CENTURY:
            self.fail(f"{value!r} is more than a century", param, ctx)
        return seconds


class StatedNumber(click.ParamType):
    """A number as a user states it: a value, a value with its standard deviation, or a range
    (`flagdata.core.stated`)."""

    name = "number"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Stated:
        """Returns what it states."""
        if isinstance(value, Stated):
            return value
        try:
            return parse(str(value))
        except UsageError as error:
            self.fail(f"{error.what}; {error.fix}", param, ctx)


class Listed(click.ParamType):
    """Texts separated by commas."""

    name = "list"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> list[str]:
        """Returns the texts, without blanks around them."""
        if isinstance(value, str):
            return [text.strip() for text in value.split(",")]
        return list(value)  # type: ignore[call-overload]


DURATION = Duration()
LISTED = Listed()
STATED = StatedNumber()
SHARE = click.FloatRange(0, 1, min_open=True, max_open=True)
"""A number between 0 and 1, neither of them."""
POSITIVE = click.IntRange(min=1)
"""A count."""
