"""Commands of flagdata in forked processes: what one of them does to the process stays in it."""

from __future__ import annotations

import os
import pickle
import shutil
import signal
import sys
import traceback
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from flagdata.cli import main
from tests.studies.failing.worker import SHARED

LONGEST = 180
"""Seconds after which a command counts as hanging."""


def invoked(arguments: Sequence[str]) -> int:
    """The exit code of a command that this process runs."""
    try:
        main(list(arguments))
    except SystemExit as ended:
        return int(ended.code or 0)
    return 0


def stand_in(function: str, kept: str) -> None:
    """Put something in the place of what a command computes: "module:function", called with the
    scene's id "kept"."""
    module, _, name = function.partition(":")
    getattr(import_module(module), name)(kept)


class Child:
    """A forked process, which may use a lake; its parent must not."""

    def __init__(self, work: Callable[[], object], folder: Path, *, longest: int = LONGEST) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self.pid = os.fork()
        if self.pid == 0:
            os.setsid()
            for name, stream in (("stdout", 1), ("stderr", 2)):
                os.dup2(os.open(folder / name, os.O_CREAT | os.O_WRONLY | os.O_TRUNC), stream)
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.alarm(longest)
            code = 70
            try:
                result = work()
                (folder / "result").write_bytes(pickle.dumps(result))
                code = 0
            except BaseException:  # noqa: BLE001 — the parent gets it
                traceback.print_exc()
            sys.stdout.flush()
            sys.stderr.flush()
            (folder / "modules").write_text(
                "\n".join(n for n in sys.modules if n.partition(".")[0] in SHARED)
            )
            os._exit(code)

    def ended(self) -> tuple[int, Any, str]:
        """Its exit code, what it gave, and what it wrote to stderr."""
        code = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        result = self._folder / "result"
        given = pickle.loads(result.read_bytes()) if code == 0 else None
        modules = self._folder / "modules"
        for name in modules.read_text().split() if modules.exists() else ():
            import_module(name)
        said = (self._folder / "stderr").read_text(errors="replace")
        shutil.rmtree(self._folder)
        return code, given, said
