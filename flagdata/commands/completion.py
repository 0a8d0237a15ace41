"""`flagdata completion`: what a shell needs to complete commands and options."""

from __future__ import annotations

import click
from click.shell_completion import BashComplete, FishComplete, ZshComplete

from flagdata.console import document, echo_lines, json_option, say

_SHELLS = {"bash": BashComplete, "zsh": ZshComplete, "fish": FishComplete}
_WHERE = {
    "bash": 'eval "$(flagdata completion bash)"  in ~/.bashrc',
    "zsh": 'eval "$(flagdata completion zsh)"  in ~/.zshrc, after compinit',
    "fish": "flagdata completion fish > ~/.config/fish/completions/flagdata.fish",
}


@click.command()
@click.argument("shell", type=click.Choice(list(_SHELLS)))
@json_option
@click.pass_context
def completion(context: click.Context, shell: str, as_json: bool) -> None:
    """Print what completes commands and options in SHELL: bash, zsh or fish.

    \b
      eval "$(flagdata completion bash)"          in ~/.bashrc
      eval "$(flagdata completion zsh)"           in ~/.zshrc, after compinit
      flagdata completion fish > ~/.config/fish/completions/flagdata.fish
    """
    script = _SHELLS[shell](context.find_root().command, {}, "flagdata", "_FLAGDATA_COMPLETE").source()
    if as_json:
        document("completion", {"shell": shell, "script": script})
        return
    echo_lines(script)
    say(f"to use it: {_WHERE[shell]}")
