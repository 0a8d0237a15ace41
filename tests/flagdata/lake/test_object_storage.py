"""A lake in a bucket: the same protocol as in a folder, by conditional puts and leases that their
holders renew."""

from __future__ import annotations

import json
import logging
import os
import pickle
import shutil
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from pathlib import Path
from urllib.request import urlopen

import pytest

import flagdata
from flagdata.core.files import durable, object_cache
from flagdata.core.files.caches import beside
from flagdata.core.findings import Severity
from flagdata.core.schema import Kind
from flagdata.errors import (
    ConflictError,
    CorruptError,
    FlagdataError,
    NotFoundError,
    RefusedError,
    UsageError,
)
from flagdata.lake import (
    Artifact,
    Lake,
    collect,
    doctor,
    lake_locks,
    object_names,
    select,
    verify,
    verify_catalog,
)
from flagdata.lake.leases import last_written
from flagdata.storage import RemotePath, StoreError, plain
from tests.flagdata.conftest import write_video
from tests.flagdata.lake.conftest import dead_owner, put_text
from tests.program import invoke
from tests.s3 import SECRETS, Careless, Denying, Forbidding, read_only, serving
from tests.studies.failing.store import failing, planned

NOW = timedelta(0)
Use = Callable[[str], None]


def put_folder(lake: Lake, text: str) -> Artifact:
    with lake.transaction(f"ingest {text}") as tx:
        path = tx.staging(".zarr")
        (path / "positions" / "c").mkdir(parents=True)
        (path / "positions" / "c" / "0").write_text(text)
        (path / "zarr.json").write_text("{}")
        name = tx.put(path)
        artifact = Artifact(
            kind=Kind.MESHES, name=text, object=name, source_hash=name.partition("/")[2]
        )
        tx.add(artifact)
    return artifact


def test_rows_and_objects_of_a_bucket_are_found_whole_by_a_fresh_handle(remote_lake: Lake) -> None:
    record, folder = put_text(remote_lake, "gusts"), put_folder(remote_lake, "sheet")
    again = Lake.open(str(remote_lake.path))
    assert set(again.rows()["name"].to_pylist()) == {"gusts", "sheet"}
    assert again.object_path(str(record.object)).read_text() == "gusts"
    local = again.whole_object(str(folder.object))
    files = {
        file.relative_to(local).as_posix(): file.read_text()
        for file in local.rglob("*")
        if file.is_file()
    }
    assert files == {"positions/c/0": "sheet", "zarr.json": "{}"}
    assert again.artifact(folder.id).object_bytes == len("sheet{}")
    assert (
        verify(again, object_names(again))
        == verify_catalog(again)
        == doctor(again, grace=NOW)
        == ()
    )


def test_what_is_withdrawn_is_collected_and_tags_keep_theirs(
    remote_lake: Lake, tmp_path: Path
) -> None:
    kept, gone = put_text(remote_lake, "kept"), put_folder(remote_lake, "gone")
    remote_lake.tag("v1")
    put_text(remote_lake, "later")
    remote_lake.withdraw([kept.id, gone.id], "withdrawn")
    assert collect(remote_lake, grace=NOW).objects == ()
    remote_lake.delete_tag("v1", discard=True)
    assert set(collect(remote_lake, grace=NOW).objects) == {kept.object, gone.object}
    assert not any(str(gone.object)[5:] in str(path) for path in remote_lake.path.rglob("*"))
    copies = [path.name for path in (tmp_path / "cache" / "objects").iterdir()]
    assert len(copies) > 1
    assert not any(
        name.endswith((f"{str(kept.object)[5:]}.mcap", f"{str(gone.object)[5:]}.zarr"))
        for name in copies
    )
    assert [finding.kind for finding in doctor(remote_lake, grace=NOW)] == ["withdrawn-collected"]


def test_two_writers_at_once_lose_no_commit(remote_lake: Lake) -> None:
    def write(writer: int) -> list[str]:
        own = Lake.open(remote_lake.path)
        return [put_text(own, f"{writer}-{i}").id for i in range(3)]

    with ThreadPoolExecutor(2) as pool:
        acknowledged = [identity for ids in pool.map(write, range(2)) for identity in ids]
    assert sorted(remote_lake.rows()["artifact"].to_pylist()) == sorted(acknowledged)
    assert len(set(acknowledged)) == 6
    assert doctor(remote_lake, grace=NOW) == ()


def test_an_object_that_changed_in_the_bucket_is_found_and_healed_by_ingesting_again(
    remote_lake: Lake, tmp_path: Path
) -> None:
    artifact = put_text(remote_lake, "gusts")
    name = str(artifact.object)
    assert remote_lake.object_path(name).read_text() == "gusts"  # what was put is kept, too
    shutil.rmtree(tmp_path / "cache" / "objects")
    place = remote_lake.objects.path(name)
    place.write_bytes(b"gustz")
    assert [finding.kind for finding in verify(remote_lake, [name])] == ["object-changed"]
    with pytest.raises(FlagdataError, match="have changed"):
        remote_lake.object_path(name)
    assert list((tmp_path / "cache" / "objects").glob("mcap-*")) == []
    with remote_lake.transaction("again") as tx:
        again = tx.staging(".mcap")
        again.write_text("gusts")
        tx.put(again)
    assert remote_lake.object_path(name).read_text() == "gusts"


def test_a_store_that_ignores_conditions_is_refused_before_anything_is_written(
    use_store: Use,
) -> None:
    with serving(Careless) as address:
        use_store(address)
        with pytest.raises(RefusedError, match="ignores the conditions"):
            Lake.create("s3://bucket/lake")
        assert not any("lake.json" in key or "catalog" in key for key in Careless.objects)


def test_credentials_show_nowhere(
    remote_lake: Lake, use_store: Use, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.DEBUG):
        put_text(remote_lake, "gusts")
        shown = [
            invoke(command, "--lake", remote_lake.path, "--json").out for command in ("ls", "log")
        ]
        shown += [repr(remote_lake.path), pickle.dumps(remote_lake).decode(errors="replace")]
        shown += [
            path.read_bytes().decode(errors="replace") for path in remote_lake.path.rglob("*")
        ]
        assert len(shown) > 8  # of the bucket, too
        with serving(Denying) as address:
            use_store(address)
            for arguments in (
                ("ls",),
                ("ls", "--json"),
                ("--debug", "verify"),
                ("gc",),
                ("tag", "v1"),
            ):
                ended = invoke(*arguments, "--lake", remote_lake.path)
                assert ended.code == 1
                shown += [ended.out, ended.err]
            with pytest.raises(FlagdataError) as caught:
                remote_lake.catalog.history()
            shown.append(str(caught.value))
    for text in (*shown, caplog.text):
        for secret in SECRETS.values():
            assert secret not in text


def test_an_address_with_credentials_is_refused_without_repeating_them() -> None:
    for address in (
        "key:secret@bucket/lake",
        "key:secret/lake",
        "bucket/lake?X-Amz-Signature=secret",
    ):
        with pytest.raises(UsageError) as caught:
            Lake.open(f"s3://{address}")
        assert "secret" not in f"{caught.value} {caught.value.where}"
    assert plain("Generic S3 error \x1b[31m↳\x1b[0m no route") == "Generic S3 error ↳ no route"
    assert (
        plain("no answer of (http://key:secret@store:9000/bucket)")
        == "no answer of (http://…@store:9000/bucket)"
    )


@pytest.mark.parametrize(
    "address", ["s3://", "s3://b", "s3://bucket//x", "s3://bucket/../x", "s3://bucket/a%41"]
)
def test_an_address_that_clients_write_in_several_ways_is_refused(address: str) -> None:
    with pytest.raises(UsageError):
        Lake.create(address)


@pytest.mark.parametrize("address", ["gs://bucket/lake", "az://bucket/lake", "hdfs://host/lake"])
def test_a_lake_at_another_storage_is_refused_and_makes_no_folder(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError, match="object storage"):
        Lake.create(address)
    assert list(tmp_path.iterdir()) == []


def test_with_credentials_that_permit_reading_alone_rows_are_read_and_nothing_is_written(
    remote_lake: Lake, use_store: Use, s3_server: str
) -> None:
    name = str(put_text(remote_lake, "gusts").object)
    with read_only(s3_server) as address:
        use_store(address)
        lake = Lake.open(str(remote_lake.path))
        assert lake.rows()["name"].to_pylist() == ["gusts"]
        assert lake.object_path(name).read_text() == "gusts"
        with pytest.raises(FlagdataError, match="can be read, but not written"):
            put_text(lake, "more")


def test_a_bucket_that_is_not_there_is_named(bucket_folder: str) -> None:
    with pytest.raises(FlagdataError, match="no bucket 'nowhere'"):
        Lake.create("s3://nowhere/lake")


def test_where_no_lake_is_in_a_bucket_it_says_so(bucket_folder: str) -> None:
    with pytest.raises(NotFoundError, match="no lake"):
        Lake.open(bucket_folder)


def test_the_credentials_of_a_profile_are_used(
    s3_server: str, use_store: Use, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    use_store(s3_server)
    for name in (*SECRETS, "AWS_ENDPOINT_URL", "AWS_REGION"):
        monkeypatch.delenv(name)
    (tmp_path / "credentials").write_text(
        "[lab]\naws_access_key_id = profilekey\naws_secret_access_key = hidden\n"
    )
    (tmp_path / "config").write_text(
        f"[profile lab]\nendpoint_url = {s3_server}\nregion = us-east-1\n"
    )
    monkeypatch.setenv("AWS_CONFIG_FILE", str(tmp_path / "config"))
    monkeypatch.setenv("AWS_SHARED_CREDENTIALS_FILE", str(tmp_path / "credentials"))
    monkeypatch.setenv("AWS_PROFILE", "lab")
    assert Lake.create(f"s3://bucket/profile-{time.time_ns()}").rows().num_rows == 0
    monkeypatch.setenv("AWS_PROFILE", "nobody")
    use_store(s3_server)
    monkeypatch.setenv("AWS_PROFILE", "nobody")
    with pytest.raises(UsageError, match="no profile 'nobody'"):
        Lake.open("s3://bucket/lake")


def test_a_put_whose_bytes_are_there_has_succeeded_however_often_it_was_sent(
    bucket_folder: str,
) -> None:
    place = RemotePath.parse(bucket_folder) / "entry"
    assert place.create(b"mine")
    assert place.create(b"mine")  # as when the answer to the first was lost
    assert not place.create(b"another")
    assert place.read_bytes() == b"mine"


def test_an_upload_whose_parts_the_store_has_joined_without_an_answer_is_made_again(
    bucket_folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "film.mcap").write_bytes(b"film")
    place, asked, lost = RemotePath.parse(bucket_folder) / "film.mcap", RemotePath._ask, [True]

    def unanswered(path: RemotePath, request: Callable[..., object]) -> object:
        answer = asked(path, request)
        if lost and lost.pop():
            raise FileNotFoundError  # NoSuchUpload, as the store says to whom asks again
        return answer

    monkeypatch.setattr(RemotePath, "_ask", unanswered)
    place.upload(tmp_path / "film.mcap")
    assert place.read_bytes() == b"film"
    lost[:] = [True] * 9
    with pytest.raises(StoreError, match="lost the parts"):
        place.upload(tmp_path / "film.mcap")


def test_a_collection_leaves_what_a_running_transaction_has_put(remote_lake: Lake) -> None:
    with remote_lake.transaction("ingest") as tx:
        path = tx.staging(".mcap")
        path.write_text("running")
        name = tx.put(path)
        assert collect(Lake.open(remote_lake.path), grace=NOW).objects == ()
        tx.add(Artifact(kind=Kind.WIND, name="running", object=name))
    assert remote_lake.object_path(name).read_text() == "running"


def test_lakes_of_other_prefixes_have_other_folders_in_the_cache() -> None:
    one, other = (beside(RemotePath("bucket", key), ".inputs") for key in ("a/b-c", "a/b/c"))
    assert one != other
    assert one.name.startswith("bucket-a-b-c-")


def test_a_forked_child_says_that_it_cannot_use_the_store(remote_lake: Lake) -> None:
    reading, writing = os.pipe()
    if (child := os.fork()) == 0:
        try:
            remote_lake.path.exists()
        except FlagdataError as error:
            os.write(writing, error.what.encode())
        finally:
            os._exit(0)
    os.close(writing)
    os.waitpid(child, 0)
    with os.fdopen(reading) as said:
        assert "forked" in said.read()


def test_the_cache_gives_up_what_was_used_least_recently(
    remote_lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = [str(put_text(remote_lake, text).object) for text in ("a" * 100, "b" * 100, "c" * 100)]
    shutil.rmtree(tmp_path / "cache" / "objects")  # of what was put
    monkeypatch.setenv("FLAGDATA_CACHE_LIMIT", "250")
    first, second = (remote_lake.object_path(name) for name in names[:2])
    long_ago = time.time() - 3600
    os.utime(first.with_name(f"{first.name}.stamp"), (long_ago, long_ago))
    third = remote_lake.object_path(names[2])
    assert [path.exists() for path in (first, second, third)] == [False, True, True]
    assert remote_lake.object_path(names[0]).read_text() == "a" * 100  # fetched again


def test_a_copy_whose_deletion_was_cut_short_is_no_copy_any_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FLAGDATA_CACHE", str(tmp_path))
    folder = tmp_path / "staged.zarr"
    folder.mkdir()
    (folder / "zarr.json").write_text("{}")
    (tmp_path / "objects").mkdir()
    object_cache.kept("zarr/0", ".zarr", folder)
    with monkeypatch.context() as killed:
        killed.setattr(shutil, "rmtree", lambda *_, **__: None)  # the process ends here
        object_cache.forget("zarr/0", ".zarr")
    assert object_cache.copy_of("zarr/0", ".zarr") is None


def cut_to_nothing(file: Path) -> None:
    file.write_bytes(b"")


def zero(file: Path) -> None:
    file.write_bytes(bytes(file.stat().st_size))


def flip(file: Path) -> None:
    status = file.stat()
    file.write_bytes(bytes([file.read_bytes()[0] ^ 1]) + file.read_bytes()[1:])
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))


@pytest.mark.parametrize("damage", [cut_to_nothing, zero, flip, Path.unlink])
def test_a_copy_that_is_not_what_was_fetched_is_fetched_again_and_said_once(
    remote_lake: Lake, caplog: pytest.LogCaptureFixture, damage: Callable[[Path], None]
) -> None:
    folder = str(put_folder(remote_lake, "sheet").object)
    for name, inside in (
        (folder, "positions/c/0"),
        (str(put_text(remote_lake, "gusts").object), ""),
    ):
        copy = remote_lake.object_path(name)
        right = (copy / inside).read_bytes()
        damage(copy / inside)
        caplog.clear()
        assert (remote_lake.object_path(name) / inside).read_bytes() == right
        assert (remote_lake.object_path(name) / inside).read_bytes() == right
        missing = damage is Path.unlink and not inside
        assert [name in message for message in caplog.messages] == ([] if missing else [True])


def test_copies_of_before_this_machine_was_started_are_compared_once(
    remote_lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = [
        str(put_folder(remote_lake, "sheet").object),
        str(put_text(remote_lake, "gusts").object),
    ]
    compared: list[Path] = []

    def hashed(path: Path, content_hash: Callable[[Path], str] = object_cache.content_hash) -> str:
        compared.append(path)
        return content_hash(path)

    monkeypatch.setattr(object_cache, "content_hash", hashed)
    copies = [remote_lake.object_path(name) for name in names]
    assert compared == []
    monkeypatch.setattr(object_cache, "boot", lambda: "another")
    for _ in range(3):
        assert [remote_lake.object_path(name) for name in names] == copies
    assert compared == copies


def test_a_copy_has_its_name_after_its_bytes_are_on_the_disk_and_a_deletion_is_confirmed(
    remote_lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = str(put_folder(remote_lake, "sheet").object)
    shutil.rmtree(tmp_path / "cache" / "objects")
    done: list[str] = []
    rename, flush = Path.rename, durable._flush
    monkeypatch.setattr(
        durable, "_flush", lambda path, noun: (done.append(path.name), flush(path, noun))
    )

    def renamed(path: Path, target: Path) -> Path:
        done.append(f"{target.name} takes its name")
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", renamed)
    copy = remote_lake.object_path(name)
    flushed, (named, folder, *_) = done[: done.index(f"{copy.name} takes its name")], done[-3:]
    assert {"0", "c", "positions", "zarr.json"} <= set(flushed)
    assert (named, folder) == (f"{copy.name} takes its name", "objects")
    done.clear()
    object_cache.forget(name, ".zarr")
    assert done[-1] == "objects"
    assert [path.name for path in copy.parent.iterdir() if copy.stem in path.name] == []


def test_a_deletion_of_a_copy_that_was_cut_short_is_ended_by_the_next(
    remote_lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    erased = put_folder(remote_lake, "sheet")
    copies = remote_lake.object_path(str(erased.object)).parent
    with monkeypatch.context() as killed:
        killed.setattr(shutil, "rmtree", lambda *_, **__: None)
        object_cache.forget(str(erased.object), ".zarr")
    assert any(str(erased.object)[5:] in path.name for path in copies.iterdir())
    remote_lake.erase([erased.id], "asked to")
    assert not any(str(erased.object)[5:] in path.name for path in copies.iterdir())


def test_a_sweep_passes_over_what_another_process_renames_meanwhile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FLAGDATA_CACHE", str(tmp_path))
    objects = tmp_path / "objects"
    objects.mkdir()
    staged = tmp_path / "staged.mcap"
    staged.write_text("gusts")
    gone = objects / "part-0.mcap"
    listed = Path.iterdir
    monkeypatch.setattr(
        Path, "iterdir", lambda path: [*listed(path), gone] if path == objects else listed(path)
    )
    object_cache.kept("mcap/0", ".mcap", staged)
    assert (objects / "mcap-0.mcap").read_text() == "gusts"


def test_files_of_a_folder_that_its_name_does_not_vouch_for_are_not_fetched(
    remote_lake: Lake, tmp_path: Path
) -> None:
    name = str(put_folder(remote_lake, "sheet").object)
    shutil.rmtree(tmp_path / "cache" / "objects")
    (remote_lake.objects.path(name) / ".sums").write_bytes(f"{'0' * 64}  zarr.json\n".encode())
    with pytest.raises(CorruptError, match="sums of its files are damaged"):
        remote_lake.object_path(name)


def test_a_staging_folder_that_its_owner_removes_meanwhile_is_old(
    bucket_folder: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = RemotePath.parse(bucket_folder) / "staging" / "0"
    monkeypatch.setattr(RemotePath, "is_dir", lambda _: True)
    assert last_written(place) == 0.0


def test_labels_and_what_was_erased_are_as_in_a_folder(remote_lake: Lake) -> None:
    gone, kept = put_folder(remote_lake, "gone"), put_text(remote_lake, "kept")
    remote_lake.tag("v1")
    remote_lake.label([kept.id], {"rating": 4}, "looked at")
    assert select(remote_lake, "label_rating = 4", columns=["name"]).to_pylist() == [
        {"name": "kept"}
    ]
    erasure = remote_lake.erase([gone.id], "asked to")
    assert (erasure.objects, erasure.tags, erasure.kept) == ((gone.object,), ("v1",), {})
    assert not (remote_lake.objects.path(str(gone.object))).is_dir()
    with pytest.raises(NotFoundError, match="was erased from all versions"):
        remote_lake.object_path(str(gone.object))
    assert [finding.kind for finding in doctor(Lake.open(str(remote_lake.path)), grace=NOW)] == [
        "erased"
    ]


def test_a_film_and_a_log_are_ingested_aligned_exported_and_loaded(
    remote_lake: Lake, wind_log: Path, confirmed_drafts: None, tmp_path: Path
) -> None:
    film = write_video(tmp_path / "field.mp4", frames=130, creation_time="2026-05-01T10:01:10Z")
    place = ("--lake", remote_lake.path)
    came = invoke("ingest", film, wind_log, "--session", "field-1", "--json", *place).document
    camera, wind = (result["artifact"] for result in came["results"])
    given = ("--by", "given", "--clock-offset", "0", "--offset-sigma", "0.1")
    aligned = invoke("align", camera, wind, *given, "--json", *place).document
    assert len(aligned["clips"]) == 2  # 130 frames at 50 Hz are 65 at 25 Hz
    assert invoke("tag", "v1", *place).code == 0
    exported = invoke(
        "export", "csv", "--where", "kind = 'recording'", "--to", tmp_path / "csv", *place
    )
    assert exported.code == 0
    assert len(list((tmp_path / "csv").rglob("*.csv"))) == 1
    shutil.rmtree(tmp_path / "cache" / "objects")
    pairs = flagdata.open(str(remote_lake.path)).pairs(at="v1")
    assert (
        list((tmp_path / "cache" / "objects").glob("mcap-*")) == []
    )  # nothing is fetched before it is needed
    assert [pairs[index].clip.shape[:2] for index in range(len(pairs))] == [(1, 30), (1, 30)]
    assert [sample.recording for sample in pairs] == [aligned["recording"]] * 2
    assert doctor(remote_lake, grace=NOW) == ()


READING = (
    ("ls",),
    ("ls", "--at", "v1"),
    ("log",),
    ("query", "--where", "kind = 'wind'"),
    ("show", "gusts"),
    ("lineage", "gusts"),
    ("diff", "v1", "main"),
    ("tag",),
    ("branch",),
    ("du",),
    ("verify",),
    ("doctor",),
    ("doctor", "--deep"),
    ("doctor", "--older-than", "0s"),
    ("gc", "--dry-run"),
    ("gc", "--dry-run", "--older-than", "0s"),
    ("expire", "--keep", "1", "--dry-run"),
    ("expire", "--keep", "1", "--dry-run", "--json"),
)
"""Commands that commit nothing."""


def test_with_keys_that_only_read_every_command_that_commits_nothing_works_and_asks_for_no_write(
    remote_lake: Lake, use_store: Use, s3_server: str, tmp_path: Path
) -> None:
    put_text(remote_lake, "gusts")
    remote_lake.tag("v1")
    put_text(remote_lake, "more")
    leftover = json.dumps({**lake_locks.owner(), "machine": "another", "pid": 1}).encode() + b"\n"
    (remote_lake.staging / ("0" * 32) / "lease").write_bytes(
        leftover
    )  # of a transaction on another machine
    with read_only(s3_server) as address:
        use_store(address)
        for command in READING:
            ended = invoke(*command, "--lake", remote_lake.path)
            assert (command, ended.code) == (command, 0), ended.err
        ended = invoke("clone", remote_lake.path, tmp_path / "clone")
        assert ended.code == 0, ended.err
        ended = invoke("pull", remote_lake.path, "--lake", tmp_path / "clone")
        assert ended.code == 0, ended.err
        assert urlopen(f"{address}/refused").read() == b""


def test_what_is_young_by_the_stores_clock_is_kept_whatever_this_machines_says(
    remote_lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    transaction = remote_lake.transaction("is given up").__enter__()
    (path := transaction.staging(".mcap")).write_text("young")
    name = transaction.put(path)
    transaction.__exit__(RuntimeError, RuntimeError(), None)
    withdrawn = put_text(remote_lake, "withdrawn")
    for ahead in (-7200.0, 7200.0):
        with monkeypatch.context() as patch:
            patch.setattr(
                time, "time_ns", lambda ahead=ahead, now=time.time_ns: now() + int(ahead * 1e9)
            )
            patch.setattr(time, "time", lambda ahead=ahead, now=time.time: now() + ahead)
            if ahead < 0:
                remote_lake.withdraw([withdrawn.id], "by a clock that is behind")
            assert collect(remote_lake, grace=timedelta(hours=1)).objects == ()
            assert [found.severity for found in doctor(remote_lake, grace=timedelta(hours=1))] == [
                Severity.NOTE
            ]
    assert remote_lake.objects.has(name)
    assert set(collect(remote_lake, grace=NOW).objects) == {name, str(withdrawn.object)}


def test_a_put_in_conflict_with_another_is_made_again(
    bucket_folder: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    place, asked, conflicts = (
        RemotePath.parse(bucket_folder) / "ref.json",
        RemotePath._ask,
        [True, True],
    )

    def conflicting(path: RemotePath, request: Callable[..., object]) -> object:
        if conflicts and "put" in request.__code__.co_names:  # 409 ConditionalRequestConflict
            conflicts.pop()
            raise FileExistsError
        return asked(path, request)

    monkeypatch.setattr(RemotePath, "_ask", conflicting)
    assert place.create(b"mine")
    conflicts[:] = [True, True]
    assert place.replace_if(place.stat().e_tag, b"other") is not None
    assert place.read_bytes() == b"other"
    conflicts[:] = [True] * 99
    with pytest.raises(StoreError, match="none of several"):
        (place.parent / "another.json").create(b"mine")


def test_without_permission_to_list_or_to_delete_a_command_says_which_is_missing(
    remote_lake: Lake, use_store: Use, s3_server: str
) -> None:
    put_text(remote_lake, "gusts")
    Forbidding.store = s3_server.removeprefix("http://")
    with serving(Forbidding) as address:
        for forbidden, command, action in (
            ("list", ("ls",), "s3:ListBucket"),
            ("list", ("tag", "v1"), "s3:ListBucket"),
            ("delete", ("tag", "v1"), "s3:DeleteObject"),
            ("delete", ("gc",), "s3:DeleteObject"),
        ):
            use_store(address)
            Forbidding.forbidden = forbidden
            ended = invoke(*command, "--lake", remote_lake.path)
            assert ended.code == 1
            assert f"have {action} permitted" in ended.err.partition("fix:")[2]


def test_a_lake_whose_making_was_killed_is_made_by_the_same_command(bucket_folder: str) -> None:
    root = RemotePath.parse(bucket_folder)
    (root / "staging" / "probe-0").write_bytes(b"1")
    assert Lake.create(f"{bucket_folder}").rows().num_rows == 0
    other = RemotePath.parse(f"{bucket_folder}-other")
    (other / "staging" / "made").write_bytes(json.dumps(dead_owner()).encode() + b"\n")
    (other / "catalog" / "_delta_log" / f"{0:020d}.json").write_bytes(b"half done")
    lake = Lake.create(str(other))
    assert lake.rows().num_rows == 0
    assert doctor(lake, grace=NOW) == ()
    with pytest.raises(ConflictError, match="a lake already"):
        Lake.create(str(other))


def test_a_lake_that_a_living_process_is_making_is_left_to_it(bucket_folder: str) -> None:
    place = RemotePath.parse(bucket_folder)
    (place / "staging" / "made").write_bytes(json.dumps(lake_locks.owner()).encode() + b"\n")
    with pytest.raises(ConflictError, match="another process is making"):
        Lake.create(bucket_folder)
    (place / "lake-of-others").write_bytes(b"1")
    with pytest.raises(ConflictError, match="something else"):
        Lake.create(bucket_folder)


def test_an_answer_that_breaks_off_is_asked_for_again_and_a_listing_goes_on_behind_its_last_name(
    bucket_folder: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, listed, broken = RemotePath.parse(bucket_folder), RemotePath._list_beneath, [2, 3]
    for number in range(5):
        (folder / str(number)).write_bytes(b"1")

    def breaking(place: RemotePath, offset: str | None) -> Iterator[object]:
        after = broken.pop() if broken else 99
        for count, meta in enumerate(listed(place, offset)):
            if count == after:
                error = StoreError("broken off")
                error.passing = True
                raise error
            yield meta

    monkeypatch.setattr(RemotePath, "_list_beneath", breaking)
    assert [name for name, _ in folder.names()] == ["0", "1", "2", "3", "4"]
    broken[:] = [0] * 9
    with pytest.raises(StoreError, match="broken off"):
        list(folder.names())


def test_a_conditional_put_whose_answer_is_lost_counts_for_its_writer(
    s3_server: str, use_store: Use
) -> None:
    address = f"s3://bucket/lost-answers-{time.time_ns()}"
    with failing(s3_server) as proxy:
        use_store(proxy)
        planned(proxy, lost=0.5, seed=1)
        commands = (
            ("init", address),
            ("tag", "v1"),
            ("branch", "side"),
            ("tag", "v1", "--delete"),
            ("gc",),
        )
        for name, *arguments in commands:
            place = () if name == "init" else ("--lake", address)
            ended = invoke(name, *arguments, *place)
            assert ended.code == 0, ended.err
        lake = Lake.open(address)
        artifacts = [put_text(lake, f"gusts {number}").id for number in range(2)]
        lake.withdraw(artifacts[:1], "wrong")
        assert lake.rows()["artifact"].to_pylist() == artifacts[1:]
        assert planned(proxy)["faults"]["lost answer of a conditional put"] > 5
        assert [finding.severity for finding in doctor(lake, grace=NOW)] == [
            Severity.WARNING
        ]  # what was withdrawn
