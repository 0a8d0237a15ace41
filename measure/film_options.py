"""Options of the commands that read one film: which cloth, which part of the picture and of the time, at which rate."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import click

from flagdata.commands.durations import DURATION

_Command = TypeVar("_Command", bound=Callable[..., object])
_OPTIONS = (
    click.option("--crop", metavar="X,Y,W,H", help="Region in which the flag is [px]; by default the whole picture."),
    click.option(
        "--flag",
        type=click.IntRange(min=1),
        metavar="N",
        help="Which moving cloth, as numbered on the page of measure --report; by default the one that moves most.",
    ),
    click.option("--start", "first", type=DURATION, metavar="TIME", help="Where to begin in the film, as in 12s."),
    click.option("--end", "last", type=DURATION, metavar="TIME", help="Where to end."),
    click.option("--true-fps", type=float, metavar="HZ", help="Rate at which a high-speed camera really ran."),
    click.option("--sequence-fps", type=float, metavar="HZ", help="Rate of a folder of images."),
)


def film_options(command: _Command) -> _Command:
    """Adds `crop`, `flag`, `first` and `last` [s], `true_fps` and `sequence_fps` [Hz], each None unless given."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command
