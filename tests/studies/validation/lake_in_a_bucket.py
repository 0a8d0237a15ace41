"""The tests of the lake with its lakes in a bucket: how many pass, and which are about a disk
alone, with the reason.

`FLAGDATA_TEST_STORAGE=s3` puts the lakes of the fixture `lake` on moto's server, on loopback.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from flagdata.core.provenance import code_version

_ROOT = Path(__file__).resolve().parents[3]
TESTS = ("tests/flagdata/lake", "tests/flagdata/record/test_ranges.py")


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Tests that passed, failed and were left out; a failure ends the validation, once all files
    have run.

    Files of tests that passed in an earlier run of the same code, which was stopped, are not run
    again.
    """
    folder = out / f"lake-in-a-bucket-{code_version()}"
    folder.mkdir(parents=True, exist_ok=True)
    cases: list[ET.Element] = []
    for file in sorted(found for place in TESTS for found in _files(_ROOT / place)):
        report = folder / f"{file.stem}.xml"
        if not report.exists():
            _test(file, report)
        own = list(ET.parse(report).iter("testcase"))
        if summary(own)["failed"]:
            report.unlink()
        cases += own
    result = summary(cases)
    if result["failed"]:
        raise AssertionError(f"failed: {result['failed']}")
    shutil.rmtree(folder)
    return result


def _files(place: Path) -> list[Path]:
    return sorted(place.glob("test_*.py")) if place.is_dir() else [place]


def _test(file: Path, report: Path) -> None:
    """Run a file of tests with its lakes in a bucket; the report appears once it is whole."""
    scratch = report.with_suffix(".part")
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        str(file),
        f"--junitxml={scratch}",
        "-o",
        "junit_family=xunit2",
    ]
    subprocess.run(
        command, cwd=_ROOT, env={**os.environ, "FLAGDATA_TEST_STORAGE": "s3"}, check=False
    )
    scratch.rename(report)


def summary(cases: list[ET.Element]) -> dict[str, Any]:
    """What the cases of a report say."""
    skipped = Counter(
        str(left.get("message")).removeprefix("of a disk: ")
        for case in cases
        for left in case.findall("skipped")
    )
    failed = [
        f"{case.get('classname')}::{case.get('name')}"
        for case in cases
        if case.find("failure") is not None or case.find("error") is not None
    ]
    return {
        "tests": len(cases),
        "passed": len(cases) - skipped.total() - len(failed),
        "failed": failed,
        "of a disk alone": dict(sorted(skipped.items())),
    }
