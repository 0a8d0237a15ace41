"""The tests of the lake with its lakes in a bucket: how many pass, and which are about a disk alone, with the reason.

`FLAGDATA_TEST_STORAGE=s3` puts the lakes of the fixture `lake` on moto's server, on loopback.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

_ROOT = Path(__file__).resolve().parents[2]
TESTS = ("tests/flagdata/lake", "tests/flagdata/record/test_ranges.py")


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Tests that passed, failed and were left out; a failure ends the validation."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        command = [sys.executable, "-m", "pytest", "-q", *TESTS, f"--junitxml={report}", "-o", "junit_family=xunit2"]
        environment = {**os.environ, "FLAGDATA_TEST_STORAGE": "s3"}
        ended = subprocess.run(command, cwd=_ROOT, env=environment, check=False)
        cases = list(ET.parse(report).iter("testcase"))
    result = summary(cases)
    if ended.returncode:
        raise AssertionError(f"pytest ended with {ended.returncode}: {result['failed']}")
    return result


def summary(cases: list[ET.Element]) -> dict[str, Any]:
    """What the cases of a report say."""
    skipped = Counter(
        str(left.get("message")).removeprefix("of a disk: ") for case in cases for left in case.findall("skipped")
    )
    failed = [
        f"{case.get('classname')}::{case.get('name')}"
        for case in cases
        if case.find("failure") is not None or case.find("error") is not None
    ]
    return {
        "tests": len(cases), "passed": len(cases) - skipped.total() - len(failed), "failed": failed,
        "of a disk alone": dict(sorted(skipped.items())),
    }  # fmt: skip
