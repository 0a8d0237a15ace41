"""Runs commands of flagdata in children of its own, one failing call each; started with calls.c
preloaded.

Each line on standard input is a JSON object: `prepare`, a "module:function" that is called here
with `argument`, or `arguments` of the command, `call` that fails (negative for none), `error`
(errno), `stays` (whether later calls fail too), `kinds` that are counted, `traced` (whether calls
are noted), `folder` whose files are counted and which is worked in. The answer is one too: exit
`code`, `calls` that there were, `trace` (a
line for each: number, function, path), and what the command printed on `stdout` and `stderr`.
"""

from __future__ import annotations

import faulthandler
import json
import mmap
import os
import struct
import sys
import traceback
from importlib import import_module
from pathlib import Path

from flagdata.cli import main

_STATE = struct.Struct("@qqiiii1024s")  # as calls.c has it
_LONGEST = 900.0  # s, of a command
SHARED = {
    "flagdata",
    "sim",
    "models",
    "measure",
    "torch",
    "zarr",
    "scipy",
    "av",
    "jinja2",
    "duckdb",
    "safetensors",
    "PIL",
    "matplotlib",
    "pandas",
    "pyarrow",
    "deltalake",
    "numcodecs",
    "obstore",
}
"""Packages whose modules, once a child has imported them, are imported before later forks."""


class Calls:
    """The memory that calls.c looks at, in this process and all that it starts."""

    def __init__(self, path: Path) -> None:
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), _STATE.size)
        self._trace = Path(f"{path}.trace")

    def begin(self, task: dict[str, object], folder: Path) -> None:
        os.truncate(self._trace, 0)
        numbers = [int(str(task[name])) for name in ("call", "error")]
        flags = [int(bool(task["stays"])), int(str(task["kinds"])), int(bool(task["traced"]))]
        self._memory[:] = _STATE.pack(0, *numbers, *flags, os.fsencode(folder))

    def end(self) -> tuple[int, str]:
        """How many there were, and the trace."""
        calls = _STATE.unpack(self._memory)[0]
        self._memory[:] = _STATE.pack(0, -1, 0, 0, 0, 0, b"")
        return calls, self._trace.read_text(errors="backslashreplace")


def run(arguments: list[str], folder: Path) -> int:
    """In a child: the command, its output into files of the folder."""
    for name, stream in (("stdout", 1), ("stderr", 2)):
        os.dup2(os.open(folder / name, os.O_CREAT | os.O_WRONLY | os.O_TRUNC), stream)
    faulthandler.dump_traceback_later(_LONGEST, exit=True)
    code = 70
    try:
        main(arguments)
    except SystemExit as ended:
        code = int(ended.code or 0)
    except BaseException:  # noqa: BLE001  the test gets it
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    imported = [name for name in sys.modules if name.partition(".")[0] in SHARED]
    (folder / "modules").write_text("\n".join(imported))
    return code


def serve() -> None:
    calls = Calls(Path(os.environ["FAILING_CALLS"]))
    for line in sys.stdin:
        task = json.loads(line)
        if "prepare" in task:
            module, _, function = task["prepare"].partition(":")
            getattr(import_module(module), function)(task["argument"])
            sys.stdout.write("{}\n")
            sys.stdout.flush()
            continue
        folder = Path(task["folder"])
        output = folder.with_name(f"{folder.name}.output")
        output.mkdir()
        calls.begin(task, folder)
        child = os.fork()
        if child == 0:
            os._exit(run(task["arguments"], output))
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        total, trace = calls.end()
        if (output / "modules").exists():
            for module in (output / "modules").read_text().split():
                import_module(module)
        said = {name: (output / name).read_text(errors="replace") for name in ("stdout", "stderr")}
        sys.stdout.write(json.dumps({"code": code, "calls": total, "trace": trace, **said}) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    serve()
