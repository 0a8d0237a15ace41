"""Errors, units, named random streams, registries, provenance and the catalog's schema."""

from __future__ import annotations

import ast
import json
import math
import pickle
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

import flagdata
from flagdata.core import provenance, rng, schema, units
from flagdata.core.findings import Finding, Severity, quality_flags
from flagdata.core.json_values import json_values
from flagdata.errors import ErrorKind, FlagdataError, RefusedError, UnknownNameError
from flagdata.recipes.registry import Registry
from tests.contract.imports import modules, tree
from tests.program import invoke


def subclasses(cls: type[FlagdataError]) -> list[type[FlagdataError]]:
    return [cls, *(s for child in cls.__subclasses__() for s in subclasses(child))]


def test_error_kinds_are_distinct_and_errors_survive_a_process_boundary() -> None:
    errors = subclasses(FlagdataError)
    assert len({e.kind for e in errors}) == len(errors)
    error = pickle.loads(pickle.dumps(RefusedError("a", where="b", fix="c")))
    assert isinstance(error, RefusedError)
    assert json_values(error) == {"kind": "refused", "what": "a", "where": "b", "fix": "c"}


def test_every_kind_of_error_is_that_of_one_class_and_keeps_its_text() -> None:
    product = [tree(path) for path in modules("flagdata", "sim", "models", "measure")]
    classes = [
        node for source in product for node in ast.walk(source) if isinstance(node, ast.ClassDef)
    ]
    errors = {"FlagdataError"}
    while (
        more := {node.name for node in classes if errors & set(map(ast.unparse, node.bases))}
        - errors
    ):
        errors |= more
    kinds = {f"ErrorKind.{kind.name}" for kind in ErrorKind}
    used = [
        [
            ast.unparse(line.value)
            for line in node.body
            if isinstance(line, ast.Assign | ast.AnnAssign) and line.value
        ]
        for node in classes
        if node.name in errors
    ]
    assert sorted(value for values in used for value in values if value in kinds) == sorted(kinds)
    assert len(used) == len(kinds) > 20
    assert json.loads(json.dumps(RefusedError.kind)) == "refused"
    assert type(json_values(RefusedError("a", fix="b"))["kind"]) is str


def test_the_version_is_that_of_the_installed_package() -> None:
    assert flagdata.__version__ == version("flagdata")


def test_a_sample_flag_leaves_an_array_of_flags_its_sixteen_bits() -> None:
    flags = np.zeros(3, dtype=np.uint16)
    flags[1:] |= schema.SampleFlag.STALE
    flags[2:] |= schema.SampleFlag.MISSING
    assert (flags | schema.SampleFlag.OK).dtype == (flags & schema.UNUSABLE).dtype == np.uint16
    assert flags.tolist() == [0, 1, 9]
    assert (schema.SampleFlag.MISSING & flags).tolist() == [0, 0, 8]


def test_an_unknown_name_suggests_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'drag'"):
        raise UnknownNameError.of("effect", "drga", ["drag", "lift"])


def test_units_agree_with_their_definitions() -> None:
    cases = [
        ("km/h", 36.0, 10.0),
        ("KTS", 1.0, 0.514444),  # BIPM: 1852/3600 m/s
        ("mph", 1.0, 0.44704),
        ("ft/min", 196.850394, 1.0),
        ("°F", 212.0, 373.15),
        ("ºC", -40.0, 233.15),
        ("inHg", 29.92126, 101325.0),
        ("deg", 180.0, math.pi),
        ("%", 50.0, 0.5),
    ]
    assert [float(units.unit(text).to_si(value)) for text, value, _ in cases] == [
        pytest.approx(si, rel=2e-6) for _, _, si in cases
    ]


def test_units_convert_back_exactly_enough() -> None:
    for name, unit in units.UNITS.items():
        assert float(unit.from_si(unit.to_si(12.5))) == pytest.approx(12.5, rel=1e-12), name


def test_every_spelling_names_a_unit_and_beaufort_is_not_one() -> None:
    assert set(units.SPELLINGS.values()) <= set(units.UNITS)
    with pytest.raises(UnknownNameError):
        units.unit("bft")


def test_a_named_stream_does_not_depend_on_other_draws() -> None:
    alone = rng.stream(7, "gust", 3).standard_normal(4)
    rng.stream(7, "camera").standard_normal(1000)
    assert np.array_equal(alone, rng.stream(7, "gust", 3).standard_normal(4))


def test_streams_of_other_names_seeds_and_types_differ() -> None:
    draws = {
        tuple(rng.stream(*key).integers(0, 2**31, 4))
        for key in [(7, "a"), (8, "a"), (7, "b"), (7, "a", "b"), (7, "ab"), (7, 1), (7, "1")]
    }
    assert len(draws) == 7


def test_a_registry_imports_only_what_is_asked_for() -> None:
    table = Registry("thing", {"join": "posixpath:join", "broken": "no_such_module:x"})
    assert table["join"]("a", "b") == "a/b"
    assert set(table) == {"join", "broken"}
    with pytest.raises(UnknownNameError, match="did you mean 'join'"):
        table["jion"]


def test_a_recipe_hash_ignores_order_and_sees_values() -> None:
    assert provenance.recipe_hash({"a": 1, "b": [2]}) == provenance.recipe_hash({"b": [2], "a": 1})
    assert provenance.recipe_hash({"a": 1}) != provenance.recipe_hash({"a": 2})
    with pytest.raises(ValueError, match="not JSON compliant"):
        provenance.recipe_hash({"a": float("nan")})


def test_the_file_hash_is_sha256(tmp_path: Path) -> None:
    (tmp_path / "abc").write_bytes(b"abc")
    # FIPS 180-2, appendix B.1
    assert (
        provenance.file_hash(tmp_path / "abc")
        == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    )


def test_two_states_of_a_checkout_are_two_versions_of_the_code(tmp_path: Path) -> None:
    def git(*arguments: str) -> str:
        who = ("-c", "user.name=a", "-c", "user.email=a@b")
        done = subprocess.run(
            ["git", *who, *arguments], cwd=tmp_path, capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    assert provenance.commit_of(tmp_path) is None
    (tmp_path / "lift.py").write_text("0.5")
    git("init", "-q")
    git("add", ".")
    git("commit", "-qm", "lift")
    commit = git("rev-parse", "--short=7", "HEAD")
    found = [provenance.commit_of(tmp_path)]
    for text in ("0.6", "0.7"):
        (tmp_path / "lift.py").write_text(text)
        found.append(provenance.commit_of(tmp_path))
    assert found[0] == commit
    assert len(set(found)) == 3
    assert all(str(one).startswith(f"{commit}-dirty.") for one in found[1:])


_REPOSITORYS_OWN = subprocess.run(
    ["git", "rev-parse", "--local-env-vars"], capture_output=True, text=True, check=True
)
GIT_VARIABLES = {
    **dict.fromkeys(_REPOSITORYS_OWN.stdout.split(), "{other}/.git"),
    "GIT_WORK_TREE": "{other}",
    "GIT_INDEX_FILE": "{other}/.git/index",
    "GIT_OBJECT_DIRECTORY": "{other}/.git/objects",
    "GIT_CEILING_DIRECTORIES": "{parent}",
    "GIT_CONFIG_PARAMETERS": "'core.worktree'='{other}'",
    "GIT_CONFIG_COUNT": "1",
    "GIT_EXTERNAL_DIFF": "true",
    "GIT_DIFF_OPTS": "-u0",
    "GIT_NAMESPACE": "other",
    "GIT_REFLOG_ACTION": "rebase",
    "GIT_TRACE": "1",
}
"""What git sets for a hook, `rebase -x` or an alias, or a user does → a value that means another
repository."""


@pytest.mark.parametrize("variable", GIT_VARIABLES)
def test_the_version_of_the_code_is_its_checkouts_within_a_hook_of_another_repository(
    variable: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    checkout, other = tmp_path / "checkout", tmp_path / "other"
    for folder in (checkout, other):
        folder.mkdir()
        (folder / "lift.py").write_text(folder.name)
        for arguments in (["init", "-q"], ["add", "."], ["commit", "-qm", folder.name]):
            subprocess.run(
                ["git", "-c", "user.name=a", "-c", "user.email=a@b", *arguments],
                cwd=folder,
                check=True,
            )
    (checkout / "lift.py").write_text("changed")
    commit = provenance.commit_of(checkout)
    monkeypatch.setenv(variable, GIT_VARIABLES[variable].format(other=other, parent=tmp_path))
    monkeypatch.setenv("GIT_CONFIG_KEY_0", "core.worktree")
    monkeypatch.setenv("GIT_CONFIG_VALUE_0", str(other))
    assert commit is not None
    assert provenance.commit_of(checkout) == commit


def test_the_catalog_schema_carries_units() -> None:
    arrow = schema.catalog_schema()
    assert arrow.field("wind").metadata[b"unit"] == b"m/s"
    assert arrow.field("wind").type == pa.float64()
    assert not arrow.field("artifact").nullable


def test_quality_flags_are_warnings_and_errors_once() -> None:
    def found(kind: str, severity: Severity) -> Finding:
        return Finding(kind=kind, severity=severity, what="")

    kinds = quality_flags(
        (found("b", Severity.WARNING), found("a", Severity.ERROR), found("b", Severity.ERROR))
    )
    assert kinds == ["a", "b"]
    assert quality_flags((found("c", Severity.NOTE),)) == []


def test_errors_on_the_command_line_say_what_and_how_to_mend_it(tmp_path: Path) -> None:
    ended = invoke("ls", "--lake", tmp_path, "--json")
    assert (ended.code, ended.document["kind"], "fix:" in ended.err) == (1, "not-found", True)


def test_a_misspelt_verb_exits_2() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "flagdata.cli", "ingets"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "ingest" in done.stderr


def test_usage_errors_are_one_json_document_too() -> None:
    ended = invoke("ls", "--bogus", "--json")
    assert (ended.code, ended.document["kind"]) == (2, "usage")
