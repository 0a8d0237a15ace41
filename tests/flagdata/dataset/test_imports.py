"""What is light stays light: clips need no torch, and loader workers need no catalog."""

from __future__ import annotations

import subprocess
import sys

import flagdata


def imported_by(statement: str, *modules: str) -> set[str]:
    code = f"import sys\n{statement}\nprint(*[m for m in {modules!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_neither_the_package_nor_cutting_clips_imports_torch():
    assert imported_by("import flagdata, flagdata.dataset", "torch", "deltalake") == set()
    assert imported_by("from flagdata.dataset import clip_rows", "torch") == set()


def test_what_a_spawned_worker_unpickles_imports_no_catalog():
    statement = "import flagdata.dataset.pairs, flagdata.dataset.loader, flagdata.dataset.cache"
    assert imported_by(statement, "deltalake", "duckdb") == set()


def test_every_public_name_is_there():
    import flagdata.dataset as dataset

    assert all(hasattr(dataset, name) for name in dataset.__all__)
    assert not hasattr(dataset, "no_such_name")
    assert callable(flagdata.open)
