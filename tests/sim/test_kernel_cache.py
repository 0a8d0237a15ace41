"""A compiled kernel is loaded only if nobody but the user could have put it there."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.errors import UsageError
from sim import compiler as build


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache folder of the user's own with a library in it."""
    if build.compiler() is None:
        pytest.skip("no C++ compiler")
    source = tmp_path / "source" / "tiny_kernel"
    source.mkdir(parents=True)
    (source / "__init__.py").touch()
    (source / "tiny.cpp").write_text('extern "C" int tiny() { return 7; }\n')
    monkeypatch.syspath_prepend(str(source.parent))
    folder = tmp_path / "own" / "cache"
    monkeypatch.setenv("FLAGDATA_CACHE", str(folder))
    assert build.compile_library("tiny_kernel", ("tiny.cpp",), without="nothing") is not None
    assert len(list(folder.glob("*.so"))) == 1
    return folder


def again() -> object:
    return build.compile_library("tiny_kernel", ("tiny.cpp",), without="nothing")


def test_a_library_in_a_folder_of_the_users_own_is_loaded_again(cache: Path) -> None:
    before = next(cache.glob("*.so")).stat().st_mtime_ns
    assert again() is not None
    assert next(cache.glob("*.so")).stat().st_mtime_ns == before


def test_the_folder_that_is_made_is_the_users_alone(cache: Path) -> None:
    assert cache.stat().st_mode & 0o077 == 0
    assert cache.parent.stat().st_mode & 0o077 == 0


@pytest.mark.parametrize(
    "place",
    [lambda cache: next(cache.glob("*.so")), lambda cache: cache, lambda cache: cache.parent],
    ids=["library", "folder", "folder above"],
)
def test_what_others_may_write_is_refused(cache: Path, place: Callable[[Path], Path]) -> None:
    part = place(cache)
    part.chmod(part.stat().st_mode | 0o002)
    with pytest.raises(UsageError, match="another user") as refused:
        again()
    assert refused.value.where == str(part)


def test_a_sticky_folder_is_safe_above_the_cache_and_not_as_the_cache(cache: Path) -> None:
    cache.parent.chmod(0o1777)
    assert again() is not None
    cache.chmod(0o1777)
    with pytest.raises(UsageError, match="another user"):
        again()


def test_a_library_of_another_user_is_refused(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = next(cache.glob("*.so"))
    if os.getuid() == 0:
        os.chown(library, 12345, -1)
    else:
        monkeypatch.setattr(os, "getuid", lambda: 12345)
    with pytest.raises(UsageError, match="another user"):
        again()
