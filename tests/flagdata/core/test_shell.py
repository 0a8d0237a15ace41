"""Command lines in messages: a shell that reads one has the words that it was made of."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from flagdata.core.shell import command_line

WORDS = [
    "a b",
    "b;touch pwned",
    "it's",
    "$HOME `id`",
    "a\nb\tc",
    "\x1b]0;x\x07",
    "März",
    "\udcffx",
    "",
    "\u202eabc",
    "a\\'\n",
]


@pytest.mark.parametrize("word", WORDS, ids=ascii)
def test_a_shell_reads_the_word_that_was_written(word: str) -> None:
    line = command_line("printf", "%s", word)
    assert line.isprintable()
    said = subprocess.run(("bash", "-c", line), capture_output=True, check=True)
    assert said.stdout == os.fsencode(word)


def test_words_that_a_shell_takes_as_they_are_are_not_quoted() -> None:
    assert (
        command_line("flagdata", "ingest", Path("a/b.mp4"), "--rate", 25)
        == "flagdata ingest a/b.mp4 --rate 25"
    )


def test_a_path_is_never_an_option() -> None:
    assert command_line("rm", Path("-r x")) == "rm './-r x'"
