"""Command lines in texts for people: what stands there can be typed as it stands, whatever its
words are."""

from __future__ import annotations

import os
import shlex
from pathlib import PurePath

_PLAIN = range(0x20, 0x7F)  # bytes of ASCII that are shown as they are
_MEANT = b"\\'"  # bytes that mean something in `$'…'`


def command_line(*words: object) -> str:
    """Writes words as a shell takes them, each quoted where the shell would cut it, or do something
    else with it.

    A word with control characters or other letters that are not shown is written as `$'…'`, which
    bash, ksh and zsh read. A path that begins with a hyphen gets `./` before it, so that no program
    takes it for an option.

    Args:
        words: a program's name and its arguments, or options with their values.
    """
    return " ".join(map(_quote_word, words))


def _quote_word(word: object) -> str:
    text = str(word)
    if isinstance(word, PurePath) and text.startswith("-"):
        text = f"./{text}"
    if text.isprintable():
        return shlex.quote(text)
    letters = (
        chr(byte) if byte in _PLAIN and byte not in _MEANT else f"\\x{byte:02x}"
        for byte in os.fsencode(text)
    )
    return f"$'{''.join(letters)}'"
