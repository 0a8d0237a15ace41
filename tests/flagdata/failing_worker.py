"""Runs commands of flagdata in children of its own, one failing call each; started with failing_calls.c preloaded.

Each line on standard input is a JSON object: `arguments` of the command, `call` that fails (negative for none), `error`
(errno), `stays` (whether later calls fail too), `folder` to work in. The answer is one too: exit `code`, `calls` that
there were, and what the command said on `stdout` and `stderr`.
"""

from __future__ import annotations

import ctypes
import faulthandler
import json
import os
import sys
import traceback
from pathlib import Path

from flagdata.cli import VERBS, main, root


def run(task: dict[str, object], folder: Path) -> int:
    library = ctypes.CDLL(None)
    for name, stream in (("stdout", 1), ("stderr", 2)):
        os.dup2(os.open(folder / name, os.O_CREAT | os.O_WRONLY | os.O_TRUNC), stream)
    counted = os.open(folder / "calls", os.O_CREAT | os.O_RDWR | os.O_TRUNC)
    os.ftruncate(counted, 8)
    faulthandler.dump_traceback_later(300, exit=True)
    code = 70
    library.failing_arm(ctypes.c_long(int(str(task["call"]))), int(str(task["error"])), int(bool(task["stays"])))
    try:
        main(list(map(str, task["arguments"])))  # type: ignore[call-overload]
    except SystemExit as ended:
        code = int(ended.code or 0)
    except BaseException:  # noqa: BLE001  the test is told of it
        traceback.print_exc()
    total = library.failing_calls()
    library.failing_arm(ctypes.c_long(-1), 0, 0)
    os.pwrite(counted, total.to_bytes(8, "little"), 0)
    sys.stdout.flush()
    sys.stderr.flush()
    return code


def serve() -> None:
    for verb in ("ingest", "align", "simulate"):  # imported once, before the first fork
        root.get_command(None, verb)  # type: ignore[arg-type]
    assert VERBS
    import flagdata.align.methods
    import flagdata.align.recording
    import flagdata.ingest.store
    import flagdata.lake  # noqa: F401

    for line in sys.stdin:
        task = json.loads(line)
        folder = Path(task["folder"])
        child = os.fork()
        if child == 0:
            os._exit(run(task, folder))
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        answer = {
            "code": code,
            "calls": int.from_bytes((folder / "calls").read_bytes(), "little"),
            "stdout": (folder / "stdout").read_text(),
            "stderr": (folder / "stderr").read_text(),
        }
        sys.stdout.write(json.dumps(answer) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    serve()
