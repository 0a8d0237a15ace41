"""Other programs' readers, each in an environment of its own
(`tests.studies.validation.environments`)."""

from __future__ import annotations

import json
import subprocess
from typing import Any

import pytest

from flagdata.errors import NotFoundError
from tests.studies.validation.environments import Environment

_OFFLINE = {
    "HF_HUB_OFFLINE": "1",
    "HF_DATASETS_OFFLINE": "1",
    "CUDA_VISIBLE_DEVICES": "",
    "PATH": "/usr/bin:/bin",
}


def read_by(environment: Environment, script: str, *arguments: object, home: object) -> Any:
    """What a script prints as JSON in its last line, run by an environment's Python; skips where
    that is absent.

    Args:
        home: a folder for what the program keeps.
    """
    try:
        python = environment.find()
    except NotFoundError as error:
        pytest.skip(f"{error.what}: make {environment.package}")
    done = subprocess.run(
        [str(python), "-I", "-c", script, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        env={**_OFFLINE, "HOME": str(home), "HF_HOME": str(home)},
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout.splitlines()[-1])
