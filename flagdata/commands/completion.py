"""`flagdata completion`: what a shell needs to complete commands and options."""

from __future__ import annotations

import click
from click.shell_completion import BashComplete, FishComplete, ZshComplete

from flagdata.core.console import document, echo_lines, say
from flagdata.verbs.verb_options import AsJson, argument, command, options

_SHELLS = {"bash": BashComplete, "zsh": ZshComplete, "fish": FishComplete}
_WHERE = {
    "bash": 'eval "$(flagdata completion bash)"  in ~/.bashrc',
    "zsh": 'eval "$(flagdata completion zsh)"  in ~/.zshrc, after compinit',
    "fish": "flagdata completion fish > ~/.config/fish/completions/flagdata.fish",
}


@options
class Completing(AsJson):
    """Which shell completes."""

    shell: str = argument("The shell.", "{bash|zsh|fish}", type=click.Choice(list(_SHELLS)))


@command(Completing)
def completion(chosen: Completing) -> None:
    """Print what completes commands and options in SHELL: bash, zsh or fish.

    \b
      eval "$(flagdata completion bash)"          in ~/.bashrc
      eval "$(flagdata completion zsh)"           in ~/.zshrc, after compinit
      flagdata completion fish > ~/.config/fish/completions/flagdata.fish
    """
    shell, root = chosen.shell, click.get_current_context().find_root().command
    script = _SHELLS[shell](root, {}, "flagdata", "_FLAGDATA_COMPLETE").source()
    if chosen.as_json:
        document("completion", {"shell": shell, "script": script})
        return
    echo_lines(script)
    say(f"to use it: {_WHERE[shell]}")
