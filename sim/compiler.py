"""Compiles kernels once for a machine and keeps them in the user's cache folder.

A library is code that this process will run, so it is loaded only if nobody but the user (or root)
could have written it, the folder it lies in, or a folder above that it could be replaced through.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import os
import platform
import shutil
import stat
import subprocess
import tempfile
import warnings
from importlib.resources import files
from pathlib import Path

from flagdata.core.files.caches import user_cache
from flagdata.errors import UsageError

_FLAGS = (
    "-std=c++17",
    "-O3",
    "-march=native",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-shared",
    "-fPIC",
    "-Wno-psabi",
)

_EFFECT = ("effect.hpp", "vector.hpp")
"""What the C++ of an effect is written with."""
_SOURCES = (
    "kernel.cpp",
    "block.hpp",
    "acting.hpp",
    "problem.hpp",
    "contact.hpp",
    "on_mesh.hpp",
    "implicit.hpp",
    "split.hpp",
    *_EFFECT,
)


def compiler() -> str | None:
    """Finds the C++ compiler: CXX, or the first of g++, clang++, c++ that is there."""
    for name in (os.environ.get("CXX"), "g++", "clang++", "c++"):
        if name and (path := shutil.which(name)):
            return path
    return None


@functools.cache
def library() -> ctypes.CDLL | None:
    """Loads the simulator's compiled kernel; None, with one warning, where it cannot be built."""
    return compile_library(
        "sim.kernel", _SOURCES, without="the simulator runs as plain torch, many times slower"
    )


def compile_library(package: str, sources: tuple[str, ...], *, without: str) -> ctypes.CDLL | None:
    """Compiles C++ sources of a package to a library; None, with one warning, where it cannot be
    built.

    Args:
        sources: file names; the first is compiled and includes the others.
        without: what it means for the user that it is not there.

    Raises:
        UsageError: another user could have written the library, or a folder that it lies in.
    """
    return _load_library({name: (files(package) / name).read_bytes() for name in sources}, without)


@functools.cache
def of_effect(header: Path) -> ctypes.CDLL | None:
    """Compiles the library of an effect's C++ (see effect.hpp); None, with one warning, where it
    cannot be built.

    Args:
        header: whose name ends in .hpp; its content when it is first asked for counts.
    """
    sources = {"acting.cpp": b'#include "given.hpp"\n', "given.hpp": header.read_bytes()}
    sources |= {name: (files("sim.kernel") / name).read_bytes() for name in _EFFECT}
    return _load_library(
        sources,
        f"{header.name} is left aside and its effect runs as plain torch, several times slower",
    )


def _load_library(sources: dict[str, bytes], without: str) -> ctypes.CDLL | None:
    """Loads the library that the first of the sources, by name, makes with the others."""
    path = compiler()
    if path is None:
        _warn("no C++ compiler found (CXX, g++, clang++, c++)", without)
        return None
    try:
        return ctypes.CDLL(str(_built(path, sources)))
    except subprocess.CalledProcessError as error:
        _warn(f"{path} failed: {error.stderr.strip()[-500:]}", without)
    except OSError as error:
        _warn(str(error), without)
    return None


def _warn(reason: str, without: str) -> None:
    warnings.warn(
        f"{without}: {reason}. Install g++ to have its kernel compiled.",
        RuntimeWarning,
        stacklevel=5,
    )


def _built(path: str, sources: dict[str, bytes]) -> Path:
    main = next(iter(sources))
    version = subprocess.run([path, "--version"], capture_output=True, check=True).stdout
    name = hashlib.sha256(
        b"\0".join([*sources.values(), version, " ".join(_FLAGS).encode(), _processor()])
    ).hexdigest()[:20]
    folder = user_cache()
    target = folder / f"{Path(main).stem}-{name}.so"
    _make(folder)
    check_owned(folder)
    if target.exists():
        check_owned(target)
        return target
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        code, built = Path(scratch) / main, Path(scratch) / "made.so"
        for part, text in sources.items():
            (Path(scratch) / part).write_bytes(text)
        subprocess.run(
            [path, *_FLAGS, "-o", str(built), str(code)], capture_output=True, check=True, text=True
        )
        built.replace(target)  # atomic: several processes may build at once
    return target


def _make(folder: Path) -> None:
    """Makes the folder and those above it that are missing, for the user alone."""
    for part in (*reversed(folder.parents), folder):
        if not part.exists():
            part.mkdir(mode=0o700, exist_ok=True)


def check_owned(path: Path) -> None:
    """Checks that only this user and root could have written a library, or what lies in a folder.

    Raises:
        UsageError: another user owns it or may write to it, or owns or may write to a folder above
            it; in folders above, a sticky bit keeps others from replacing what is not theirs.
    """
    resolved = path.resolve()
    for part in (resolved, *resolved.parents):
        status = part.stat()
        sticky = part != resolved and part.is_dir() and bool(status.st_mode & stat.S_ISVTX)
        foreign = status.st_uid not in (os.getuid(), 0)
        writable = bool(status.st_mode & stat.S_IWOTH) or (
            bool(status.st_mode & stat.S_IWGRP) and not _alone(status.st_gid)
        )
        if foreign or (writable and not sticky):
            raise UsageError(
                f"another user could have written the compiled kernels in {str(user_cache())!r}",
                where=str(part),
                fix="set FLAGDATA_CACHE to a folder that only you can write (chmod go-w), on a "
                "path of such folders",
            )


def _alone(group: int) -> bool:
    """Returns whether the group is the user's own, with nobody else in it."""
    import grp
    import pwd

    try:
        user, entry = pwd.getpwuid(os.getuid()).pw_name, grp.getgrgid(group)
    except KeyError:
        return False
    return entry.gr_name == user and set(entry.gr_mem) <= {user}


def _processor() -> bytes:
    """Describes what -march=native depends on: a cache folder may be shared between machines."""
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = info.read_text(encoding="utf-8", errors="replace").splitlines()
        relevant = {
            line
            for line in lines
            if line.startswith(("flags", "Features", "model name", "CPU part"))
        }
        return "\n".join(sorted(relevant)).encode()
    return f"{platform.machine()} {platform.processor()}".encode()
