"""`flagdata help`: the help of the program or of one of its commands, on stdout."""

from __future__ import annotations

import click

from flagdata.core.console import print_help
from flagdata.errors import UnknownNameError
from flagdata.verbs.verb_options import AsJson, argument, command, options


@options
class Helping(AsJson):
    """Whose help is shown."""

    verb: str | None = argument("A command.", "[VERB]", default=None)


@command(Helping)
def help_(chosen: Helping) -> None:
    """Show the help of flagdata, or of the command VERB.

    \b
      flagdata help
      flagdata help measure
    """
    shown, verb = click.get_current_context().find_root(), chosen.verb
    if verb is not None:
        known = shown.command.list_commands(shown) if isinstance(shown.command, click.Group) else []
        found = (
            shown.command.get_command(shown, verb)
            if isinstance(shown.command, click.Group)
            else None
        )
        if found is None:
            raise UnknownNameError.of("command", verb, known, where=shown.command_path)
        shown = click.Context(found, info_name=verb, parent=shown)
    print_help(shown, as_json=chosen.as_json)
