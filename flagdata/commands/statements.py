"""Numbers that a user states on the command line: a value, a value with its standard deviation, or a range."""

from __future__ import annotations

import click

from flagdata.errors import UsageError
from flagdata.stated import Stated, parse


class StatedNumber(click.ParamType):
    """One of the forms of `flagdata.stated`."""

    name = "number"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Stated:
        """What it states."""
        if isinstance(value, Stated):
            return value
        try:
            return parse(str(value))
        except UsageError as error:
            self.fail(f"{error.what}; {error.fix}", param, ctx)


STATED = StatedNumber()
