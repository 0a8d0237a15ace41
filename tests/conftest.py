"""Fixtures for all tests."""

from __future__ import annotations

import atexit
import gc
import os
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path

import hypothesis
import pytest

from flagdata.errors import NotFoundError
from flagdata.lake import place_probing
from flagdata.storage import connection
from sim.blender import environment
from tests.evidence import REFERENCE
from tests.s3 import BUCKET, SECRETS, moto

# A busy machine is no defect: what may take how long is the claim of tests of its own
# (pytest-timeout ends a hang).
hypothesis.settings.register_profile("whatever-the-load", deadline=None)
hypothesis.settings.load_profile("whatever-the-load")

REPOSITORY = Path(__file__).resolve().parent.parent
LONGEST = (
    "docs/test_pages.py",
    "test_readme.py",
    "sim/datasets/test_build.py",
    "measure/loop/test_run.py",
    "measure/propose/test_term_search.py",
    "flagdata/lake/test_object_storage.py",
    "test_hostile.py",
    "flagdata/test_failing_calls.py",
    "docs/test_notebooks.py",
    "models/training/test_train_command.py",
    "flagdata/lake/test_unfinished.py",
    "measure/loop/test_carried.py",
    "flagdata/lake/test_integrity.py",
    "flagdata/lake/test_remaking.py",
    "flagdata/lake/test_killed_on_a_bucket.py",
    "contract/test_effects.py",
)
"""Files that take longest, begun first, so that the two workers of `make test` end together."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    place = {REPOSITORY / "tests" / name: number for number, name in enumerate(LONGEST)}
    if missing := [path for path in place if not path.is_file()]:
        raise pytest.UsageError(
            f"LONGEST in tests/conftest.py names files that are not there: {missing}"
        )
    items.sort(key=lambda item: place.get(item.path, len(place)))


def pytest_sessionfinish() -> None:
    """Searches once for garbage, whose finalizers may fail; pytest would search five times, seconds
    each."""
    gc.collect()
    gc.freeze()
    atexit.register(
        gc.unfreeze
    )  # what libraries of C hold is let go at the exit, or they report it as leaked


@pytest.fixture(scope="session")
def reference_data() -> Path:
    """The folder of real recordings and reference outputs; it is not part of the project."""
    if not REFERENCE.is_dir():
        pytest.skip(f"reference data absent: no folder {REFERENCE} (set FLAGDATA_REFERENCE)")
    return REFERENCE


@pytest.fixture(scope="session")
def blender() -> Iterator[environment.Environment]:
    """Blender's environment: FLAGDATA_BLENDER, `.venv-blender` as `make test` makes it, or the
    user's.

    One that is there and does not work is an error, not a reason to skip.
    """
    made = environment.interpreter(REPOSITORY / ".venv-blender")
    with pytest.MonkeyPatch.context() as patch:
        if environment.SETTING not in os.environ and made.exists():
            patch.setenv(environment.SETTING, str(made))
        try:
            python = environment.find()
        except NotFoundError as error:
            if environment.SETTING in os.environ:
                raise
            pytest.skip(f"{error.what}: make .venv-blender")
        yield environment.check(python)


@pytest.fixture(scope="session")
def s3_server() -> Iterator[str]:
    """The address of an S3 server on loopback."""
    with moto() as address:
        yield address


@pytest.fixture
def use_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], None]]:
    """Directs this process to a server, with credentials that it takes and a cache of its own."""

    def forget() -> None:
        connection.settings.cache_clear()
        connection._client.cache_clear()
        place_probing.probe.cache_clear()

    def use(address: str) -> None:
        forget()
        for variable in [name for name in os.environ if name.startswith("AWS_")]:
            monkeypatch.delenv(variable)
        for name, value in (
            *SECRETS.items(),
            ("AWS_ENDPOINT_URL", address),
            ("AWS_REGION", "us-east-1"),
        ):
            monkeypatch.setenv(name, value)
        monkeypatch.setenv("AWS_CONFIG_FILE", str(tmp_path / "no-config"))
        monkeypatch.setenv("AWS_SHARED_CREDENTIALS_FILE", str(tmp_path / "no-credentials"))
        monkeypatch.setenv("FLAGDATA_CACHE", str(tmp_path / "cache"))

    yield use
    forget()


@pytest.fixture
def bucket_folder(s3_server: str, use_store: Callable[[str], None]) -> str:
    """The address of an empty prefix of a bucket."""
    use_store(s3_server)
    return f"s3://{BUCKET}/{uuid.uuid4().hex}"
