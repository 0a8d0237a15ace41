"""`flagdata help`: the help of the program or of one of its commands, on stdout."""

from __future__ import annotations

import click

from flagdata.console import json_option, print_help
from flagdata.errors import UnknownNameError


@click.command("help")
@click.argument("verb", required=False)
@json_option
@click.pass_context
def help_(context: click.Context, verb: str | None, as_json: bool) -> None:
    """Show the help of flagdata, or of the command VERB.

    \b
      flagdata help
      flagdata help measure
    """
    shown = context.find_root()
    if verb is not None:
        known = shown.command.list_commands(shown) if isinstance(shown.command, click.Group) else []
        found = shown.command.get_command(shown, verb) if isinstance(shown.command, click.Group) else None
        if found is None:
            raise UnknownNameError.of("command", verb, known, where=shown.command_path)
        shown = click.Context(found, info_name=verb, parent=shown)
    print_help(shown, as_json=as_json)
