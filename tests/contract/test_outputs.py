"""What a user names goes through `flagdata.core.files.outputs`: of the other modules, those listed
alone write or remove files.

The test reads the source. A module that needs to write something else is added here, with the
reason why what it writes is never a user's.
"""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

from tests.contract.imports import ROOT, modules, tree

SHARED = {"flagdata/core/files/outputs.py", "flagdata/core/files/manifest.py"}
LAKE = "writes inside a lake or its staging, under names of its own"
INSIDE = "writes into a scratch folder that the caller made with flagdata.core.files.outputs"
SCRATCH = "writes into a temporary folder of its own"
ALLOWED = {
    "flagdata/core/files/durable.py": LAKE,
    "flagdata/lake/leases.py": LAKE,
    "flagdata/lake/lake.py": LAKE,
    "flagdata/lake/delta_log.py": LAKE,
    "flagdata/lake/log_summaries.py": LAKE,
    "flagdata/lake/marker_sequences.py": LAKE,
    "flagdata/lake/mesh_sequences.py": LAKE,
    "flagdata/lake/objects.py": LAKE,
    "flagdata/lake/refs.py": LAKE,
    "flagdata/lake/catalog.py": LAKE,
    "flagdata/lake/place_probing.py": "tries what a disk can do, by files of its own in staging",
    "flagdata/lake/rowfiles.py": "writes into memory",
    "flagdata/lake/lake_locks.py": LAKE,
    "flagdata/storage/path.py": "writes, removes and renames what its callers name, as pathlib "
    "does for folders",
    "flagdata/core/files/object_cache.py": "a cache of a lake's objects by their hash",
    "sim/datasets/card.py": LAKE
    + "; a path that the user gives goes through flagdata.core.files.outputs",
    "flagdata/lake/deposit.py": LAKE,
    "flagdata/lake/restoring.py": LAKE,
    "measure/closing/verdict_artifacts.py": LAKE,
    "measure/commands/measurement_artifact.py": LAKE,
    "models/training/train_command.py": LAKE,
    "sim/datasets/build_jobs.py": LAKE,
    "flagdata/core/files/checksums.py": "states the checksums inside a folder that its caller made",
    "flagdata/core/files/file_locks.py": "the lock in a run folder or a cache",
    "flagdata/record/record_file.py": "writes a record into staging or to a scratch path, and only "
    "where nothing is",
    "flagdata/record/salvage.py": "removes the record that it has itself just made",
    "flagdata/commands/ingest_sources.py": "removes the crop picture that it has itself just "
    "written",
    "flagdata/answer/answer.py": INSIDE,
    "flagdata/export/csv_text.py": INSIDE,
    "flagdata/export/mcap.py": INSIDE,
    "flagdata/export/mp4.py": INSIDE,
    "flagdata/export/parquet.py": INSIDE,
    "flagdata/export/croissant.py": INSIDE,
    "flagdata/export/webdataset.py": INSIDE,
    "flagdata/export/lerobot.py": INSIDE,
    "flagdata/export/zarr_groups.py": INSIDE,
    "flagdata/export/wind_csv.py": INSIDE,
    "flagdata/ingest/meshes/folder.py": INSIDE,
    "measure/observables/observables_table.py": INSIDE,
    "flagdata/commands/query.py": INSIDE,
    "measure/simulated_camera.py": INSIDE,
    "measure/demo/demo_command.py": INSIDE,
    "measure/demo/story.py": INSIDE,
    "measure/demo/logger.py": INSIDE,
    "measure/demo/demo_recording.py": INSIDE,
    "measure/demo/tracked.py": INSIDE,
    "sim/blender/worker.py": SCRATCH,
    "sim/datasets/film_record.py": SCRATCH,
    "sim/datasets/build_plan.py": SCRATCH,
    "flagdata/packages/installed_names.py": "the building of a wheel, in the folder that it builds "
    "in",
    "flagdata/dataset/cache.py": "a cache: files named by 64 hex digits and its own two, whichever "
    "folder it is in",
    "measure/cloth/calibration_artifact.py": LAKE,
    "measure/measuring_model/reading_model_folder.py": LAKE,
    "sim/workers/kept_simulations.py": "a cache: files named by 32 hex digits, by put_if_absent, "
    "whichever folder it is in",
    "sim/compiler.py": "flagdata's own cache folder",
    "models/training/checkpoint.py": "the run folder of a training",
    "models/trained/model_folder.py": "writes into folders that its callers make: staging, a run "
    "folder, shipped models",
}

ALWAYS = {
    "write_text",
    "write_bytes",
    "unlink",
    "rmtree",
    "rmdir",
    "savefig",
    "to_zarr",
    "imwrite",
    "copyfile",
    "copytree",
    "copy2",
    "move",
    "rename",
    "renames",
    "removedirs",
    "touch",
    "symlink_to",
    "hardlink_to",
    "mkdir",
    "makedirs",
    "ParquetWriter",
    "write_table",
    "save_file",
    "savez",
    "savez_compressed",
    "write_csv",
    "write_parquet",
    "sink_parquet",
    "TemporaryDirectory",
    "mkdtemp",
    "mkstemp",
}
"""Calls that write, rename or remove, by the last part of their name."""
CALLED = {*ALWAYS, "open", "open_group", "OSFile", "FileIO", "replace", "link", "save"}
TO_MEMORY = {"savefig", "savez", "savez_compressed", "save", "write_csv"}
"""Of these, those that also write to a buffer: a call whose target is a name bound to BytesIO or
StringIO."""


def buffers(module: ast.AST) -> set[str]:
    """Names that are bound to a buffer in memory somewhere in the module."""
    found: set[str] = set()
    for node in ast.walk(module):
        value = getattr(node, "value", None)
        if not isinstance(value, ast.Call) or last_name(value) not in ("BytesIO", "StringIO"):
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        found |= {target.id for target in targets if isinstance(target, ast.Name)}
    return found


def last_name(call: ast.Call) -> str:
    made = call.func
    return (
        made.attr
        if isinstance(made, ast.Attribute)
        else made.id
        if isinstance(made, ast.Name)
        else ""
    )


def writes(call: ast.Call, memory: set[str]) -> bool:
    name = last_name(call)
    words = [*call.args, *(keyword.value for keyword in call.keywords)]
    if name in TO_MEMORY and any(
        isinstance(word, ast.Name) and word.id in memory for word in words
    ):
        return False
    if name in ("open", "open_group", "OSFile", "FileIO"):
        modes = [
            word.value
            for word in words
            if isinstance(word, ast.Constant) and isinstance(word.value, str)
        ]
        return any(mode.strip("bt+") in ("w", "a", "x", "w-") and mode for mode in modes)
    if name in (
        "replace",
        "link",
    ):  # Path.replace takes one argument, str.replace two, dataclasses.replace keywords
        module = (
            isinstance(call.func, ast.Attribute)
            and isinstance(call.func.value, ast.Name)
            and call.func.value.id
        )
        return module == "os" or (name == "replace" and len(call.args) == 1 and not call.keywords)
    if name == "save" and isinstance(call.func, ast.Attribute):
        return bool(call.args) and not isinstance(call.func.value, ast.Name | ast.Attribute)
    return name in ALWAYS


def writing(path: Path) -> list[str]:
    text = path.read_text(encoding="utf-8")
    if not any(f"{name}(" in text for name in CALLED):
        return []
    memory = buffers(tree(path))
    calls = [node for node in ast.walk(tree(path)) if isinstance(node, ast.Call)]
    return [f"line {call.lineno}: {last_name(call)}" for call in calls if writes(call, memory)]


@cache
def found() -> dict[str, list[str]]:
    paths = modules("flagdata", "sim", "models", "measure")
    return {path.relative_to(ROOT).as_posix(): lines for path in paths if (lines := writing(path))}


def test_no_other_module_writes_renames_or_removes_files() -> None:
    assert {
        path: lines for path, lines in found().items() if path not in SHARED | ALLOWED.keys()
    } == {}


def test_every_module_that_is_allowed_to_does() -> None:
    assert sorted(ALLOWED.keys() - found().keys()) == []


CALLS_THAT_WRITE = (
    "path.write_text('a')",
    "figure.savefig(path)",
    "shutil.rmtree(folder)",
    "scratch.replace(path)",
    "os.replace(a, b)",
    "open(path, 'w')",
    "path.open('xb')",
)
OTHERS = (
    "path.open()",
    "path.open('rb')",
    "text.replace('a', 'b')",
    "replace(recipe, seed=1)",
    "buffer = io.BytesIO()\nfigure.savefig(buffer)",
)


def test_calls_that_write_are_recognised(tmp_path: Path) -> None:
    recognised = []
    for i, line in enumerate((*CALLS_THAT_WRITE, *OTHERS)):
        (tmp_path / f"module{i}.py").write_text(line)
        recognised += [line] * bool(writing(tmp_path / f"module{i}.py"))
    assert recognised == list(CALLS_THAT_WRITE)
