"""Addresses of storage, streams and machines are refused as what they are; none becomes a local
folder."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import click
import pytest

import flagdata
from flagdata.cli import VERBS
from flagdata.core.console import LocalPath
from flagdata.core.files.addresses import local_path
from flagdata.dataset import DecodedCache
from flagdata.errors import UsageError
from flagdata.ingest import open_camera, read_log, sniff
from flagdata.lake import Lake
from tests.program import invoke

ADDRESSES = [
    ("s3://bucket/lake", "object storage", "copy it to a local disk"),
    ("gs://bucket/lake", "object storage", "copy it to a local disk"),
    ("abfss://box@account/lake", "object storage", "copy it to a local disk"),
    ("rtsp://127.0.0.1:9/x", "a live stream", "record it to a file"),
    ("HTTPS://example.org/film.mp4", "a file on the web", "download it"),
    ("file:///data/lake", "a file: address", "give the path: /data/lake"),
    ("ssh://host/data", "another machine", "mount it"),
    ("me@host:/data/lake", "another machine", "mount it"),
    ("new-thing+v2://x", "another machine or service", "give the local path"),
]
PATHS = [
    "lake",
    "./s3/lake",
    "/data/s3:/lake",
    "log 12:30.csv",
    "C:/films/a.mp4",
    "wind:a.csv",
    "a=b/c",
    ".",
    "s3:",
]


def test_an_address_is_refused_as_what_it_is_as_text_and_as_a_path() -> None:
    for address, what, fix in ADDRESSES:
        for given in (address, Path(address)):  # which makes one slash of two
            with pytest.raises(UsageError) as refused:
                local_path(given)
            error = refused.value
            assert (what in error.what, fix in error.fix, error.where) == (
                True,
                True,
                str(given),
            ), address


def test_what_is_no_address_stays_the_path_it_is() -> None:
    assert [local_path(text) for text in PATHS] == [Path(text) for text in PATHS]


ADDRESSED = [
    "init gs://bucket/lake",
    "init --lake gs://bucket/lake",
    "ls --lake gs://bucket/lake",
    "ingest rtsp://127.0.0.1:9/x --lake lake",
    "ingest a.csv --sensor https://example.org/a.toml --lake lake",
    "export csv --to s3://bucket/out --lake lake",
    "recover http://example.org/a.mcap b.mcap --lake lake",
    "simulate https://example.org/flag --lake lake",
    "build flagsim-small --lake abfss://bucket/lake",
    "build s3://bucket/recipe.toml --lake lake",
    "train sdn --lake gs://bucket/lake",
    "measure rtsp://127.0.0.1:9/x",
    "measure film.mp4 --report s3://bucket/page.html",
    "close-loop s3://bucket/tracks.csv",
]


def test_commands_refuse_addresses_of_lakes_sources_and_outputs_and_make_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Lake.create("lake")
    Path("a.csv").write_text("time,wind_speed (m/s)\n2026-05-01T12:00:00Z,5\n")
    before = sorted(tmp_path.rglob("*"))
    offenders = []
    for command in ADDRESSED:
        code, _, err = invoke(*command.split())
        if code != 2 or "address" not in err or sorted(tmp_path.rglob("*")) != before:
            offenders.append((command, code, err))
    assert offenders == []


def test_the_library_refuses_them_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    uses = [flagdata.open, Lake.open, Lake.create, open_camera, read_log, sniff]
    for use in (*uses, lambda path: DecodedCache(path, limit=1)):
        with pytest.raises(UsageError, match="object storage"):
            use("gs://bucket/a")
    assert list(tmp_path.iterdir()) == []


def test_every_path_of_the_command_line_is_checked() -> None:
    verbs = [
        getattr(import_module(module), name)
        for module, name in (v[0].split(":") for v in VERBS.values())
    ]
    commands = [verb if isinstance(verb, click.Command) else verb.command for verb in verbs]
    while commands:
        command = commands.pop()
        commands += command.commands.values() if isinstance(command, click.Group) else []
        paths = [p for p in command.params if isinstance(p.type, click.Path)]
        assert all(isinstance(p.type, LocalPath) for p in paths), command.name
