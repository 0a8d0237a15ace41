"""Compiles kernels once for a machine and keeps them in the user's cache folder."""

from __future__ import annotations

import ctypes
import functools
import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
import warnings
from importlib.resources import files
from pathlib import Path

_FLAGS = (
    "-std=c++17", "-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-shared", "-fPIC", "-Wno-psabi",
)  # fmt: skip

_SOURCES = ("kernel.cpp", "block.hpp", "contact.hpp", "implicit.hpp")


def cache_folder() -> Path:
    """Where compiled kernels are kept: FLAGDATA_CACHE, or `flagdata` in the user's cache folder."""
    if chosen := os.environ.get("FLAGDATA_CACHE"):
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "flagdata"


def compiler() -> str | None:
    """The C++ compiler: CXX, or the first of g++, clang++, c++ that is there."""
    for name in (os.environ.get("CXX"), "g++", "clang++", "c++"):
        if name and (path := shutil.which(name)):
            return path
    return None


@functools.cache
def library() -> ctypes.CDLL | None:
    """The simulator's compiled kernel; None, with one warning, where it cannot be built."""
    return compiled("sim.kernel", _SOURCES, without="the simulator runs as plain torch, many times slower")


def compiled(package: str, sources: tuple[str, ...], *, without: str) -> ctypes.CDLL | None:
    """C++ sources of a package as a library; None, with one warning, where it cannot be built.

    Args:
        sources: file names; the first is compiled and includes the others.
        without: what it means for the user that it is not there.
    """
    path = compiler()
    if path is None:
        _warn("no C++ compiler found (CXX, g++, clang++, c++)", without)
        return None
    try:
        return ctypes.CDLL(str(_built(path, package, sources)))
    except subprocess.CalledProcessError as error:
        _warn(f"{path} failed: {error.stderr.strip()[-500:]}", without)
    except OSError as error:
        _warn(str(error), without)
    return None


def _warn(reason: str, without: str) -> None:
    warnings.warn(f"{without}: {reason}. Install g++ to have its kernel compiled.", RuntimeWarning, stacklevel=4)


def _built(path: str, package: str, names: tuple[str, ...]) -> Path:
    sources = {name: (files(package) / name).read_bytes() for name in names}
    version = subprocess.run([path, "--version"], capture_output=True, check=True).stdout
    name = hashlib.sha256(
        b"\0".join([*sources.values(), version, " ".join(_FLAGS).encode(), _processor()])
    ).hexdigest()[:20]
    folder = cache_folder()
    target = folder / f"{Path(names[0]).stem}-{name}.so"
    if target.exists():
        return target
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        code, made = Path(scratch) / names[0], Path(scratch) / "made.so"
        for part, text in sources.items():
            (Path(scratch) / part).write_bytes(text)
        subprocess.run([path, *_FLAGS, "-o", str(made), str(code)], capture_output=True, check=True, text=True)
        made.replace(target)  # atomic: several processes may build at once
    return target


def _processor() -> bytes:
    """What -march=native depends on: a cache folder may be shared between machines."""
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = info.read_text(encoding="utf-8", errors="replace").splitlines()
        kept = {line for line in lines if line.startswith(("flags", "Features", "model name", "CPU part"))}
        return "\n".join(sorted(kept)).encode()
    return f"{platform.machine()} {platform.processor()}".encode()
