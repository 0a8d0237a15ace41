"""`flagdata help`: the help of the program or of one of its commands, on stdout."""

from __future__ import annotations

import click

from flagdata.console import json_option, print_help
from flagdata.errors import UnknownNameError


@click.command("help")
@click.argument("verbs", nargs=-1, metavar="[VERB]")
@json_option
@click.pass_context
def help_(context: click.Context, verbs: tuple[str, ...], as_json: bool) -> None:
    """Show the help of flagdata, or of the command VERB.

    \b
      flagdata help
      flagdata help measure
      flagdata help challenge make
    """
    shown = context.find_root()
    for verb in verbs:
        group = shown.command
        known = group.list_commands(shown) if isinstance(group, click.Group) else []
        found = group.get_command(shown, verb) if isinstance(group, click.Group) and verb in known else None
        if found is None:
            raise UnknownNameError.of("command", verb, known, where=shown.command_path)
        shown = click.Context(found, info_name=verb, parent=shown)
    print_help(shown, as_json=as_json)
