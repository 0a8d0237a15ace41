"""The scripts of the page about clusters: a shell reads them, and what they call exists."""

from __future__ import annotations

import re
import subprocess

import pytest

from tests.docs.pages import files
from tests.docs.test_commands import Line, fault

SCRIPTS = files("cluster.md")
OPTION = re.compile(r"(?<![\w-])(--[a-z][a-z-]*)(?=[\s=]|$)")


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_shell_reads_the_script(name: str) -> None:
    subprocess.run(["bash", "-n"], input=SCRIPTS[name].encode(), check=True)


def test_the_scripts_call_commands_with_options_that_there_are() -> None:
    from distributed.cli import dask_scheduler, dask_worker

    of_dask = {"scheduler": dask_scheduler.main, "worker": dask_worker.main}
    found = 0
    for text in SCRIPTS.values():
        for program, rest in re.findall(
            r"^(?:.*; do )?(flagdata|dask) ([^;&\n]+)", text, flags=re.MULTILINE
        ):
            if program == "flagdata":
                assert fault(Line(f"flagdata {rest}", typed=True), "cluster.md") is None
            else:
                command = of_dask[rest.split()[0]]
                known = {
                    word for one in command.params for word in (*one.opts, *one.secondary_opts)
                }
                assert set(OPTION.findall(rest)) <= known, rest
            found += 1
    assert found == 7


def test_every_array_job_is_divided_as_its_build_says() -> None:
    text = SCRIPTS["shards.sbatch"]
    (jobs,) = re.findall(r"--array=1-(\d+)", text)
    assert f'--shard "$part/{jobs}"' in text
