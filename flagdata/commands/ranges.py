"""Ranges on the command line: two numbers, LOW:HIGH."""

from __future__ import annotations

import math

import click


class NumberRange(click.ParamType):
    """A range such as 0.12:0.15; the lower end comes first."""

    name = "range"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:  # fmt: skip
        """Both ends."""
        if isinstance(value, tuple):
            return value
        low, colon, high = str(value).partition(":")
        try:
            ends = float(low), float(high)
        except ValueError:
            colon, ends = "", (math.nan, math.nan)
        if not colon or not all(map(math.isfinite, ends)) or ends[0] >= ends[1]:
            self.fail(f"{value!r} is not a range; give LOW:HIGH, the lower end first, as in 0.12:0.15", param, ctx)
        return ends


RANGE = NumberRange()
