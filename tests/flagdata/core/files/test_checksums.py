"""Checksums beside files and at their end: what they find, and that other programs read them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.files.checksums import SUMS, check_sums, is_sealed, seal_bytes, write_sums
from flagdata.errors import CorruptError


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "made"
    (made / "inner").mkdir(parents=True)
    (made / "a.bin").write_bytes(b"abc")
    (made / "inner" / "b.bin").write_bytes(bytes(range(64)))
    write_sums(made)
    return made


def test_the_checksums_are_those_of_sha256sum(folder: Path) -> None:
    # SHA-256 of "abc": FIPS 180-2, appendix B.1
    first = (folder / SUMS).read_text().splitlines()[0]
    assert first == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  a.bin"
    assert (
        subprocess.run(["sha256sum", "-c", "--quiet", SUMS], cwd=folder, check=False).returncode
        == 0
    )
    check_sums(folder, fix="")


@pytest.mark.parametrize("name", ["a.bin", "inner/b.bin", SUMS])
def test_every_bit_that_changes_is_found(folder: Path, name: str) -> None:
    path = folder / name
    whole = path.read_bytes()
    for bit in range(0, 8 * len(whole), 1 if name != SUMS else 5):
        changed = bytearray(whole)
        changed[bit // 8] ^= 1 << bit % 8
        path.write_bytes(changed)
        with pytest.raises(CorruptError):
            check_sums(folder, fix="")
    path.write_bytes(whole)
    check_sums(folder, fix="")


def test_a_file_that_is_missing_or_was_added_is_named(folder: Path) -> None:
    (folder / "c.bin").write_bytes(b"")
    with pytest.raises(CorruptError, match="does not list this file") as caught:
        check_sums(folder, fix="restore it")
    assert (caught.value.where, caught.value.fix) == (str(folder / "c.bin"), "restore it")
    (folder / "c.bin").unlink()
    (folder / "a.bin").unlink()
    with pytest.raises(CorruptError, match="missing"):
        check_sums(folder, fix="")


def test_a_sealed_array_is_read_by_numpy_and_every_bit_counts(tmp_path: Path) -> None:
    path, array = tmp_path / "one.npy", np.arange(6, dtype=np.float16).reshape(2, 3)
    np.save(path, array)
    assert not is_sealed(path)
    whole = seal_bytes(path.read_bytes())
    path.write_bytes(whole)
    assert is_sealed(path)
    assert np.array_equal(np.load(path, mmap_mode="r"), array)
    for bit in range(8 * len(whole)):
        changed = bytearray(whole)
        changed[bit // 8] ^= 1 << bit % 8
        path.write_bytes(changed)
        assert not is_sealed(path)
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        assert not is_sealed(path)
