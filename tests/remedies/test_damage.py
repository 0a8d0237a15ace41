"""Remedies of what a disk has damaged: they lead to the object, and save what is whole."""

from __future__ import annotations

from pathlib import Path

from flagdata.lake import Lake
from tests.remedies.user import User

STAMPS = "align first mast --by stamps --offset-sigma 0.1"


def flipped(data: bytes) -> bytes:
    """With another byte in its first picture."""
    middle = data.index(b"\xff\xd8\xff") + 500
    return data[:middle] + bytes([data[middle] ^ 0xFF]) + data[middle + 1 :]


def changed(user: User, name: str, data: bytes | None = None) -> str:
    """Damage an artifact's object behind the lake's back; the object's name."""
    lake = Lake.open(user.folder / "lake")
    name = str(lake.artifact(name).object)
    path = Path(lake.object_path(name))
    path.chmod(0o644)
    path.write_bytes(flipped(path.read_bytes()) if data is None else data)
    return name


def test_a_damaged_frame_is_listed_by_verify_and_the_others_are_saved(user: User) -> None:
    name = changed(user, "first")
    user.meets(
        "record/record_checksums.py", "save the rest of it: flagdata recover", *STAMPS.split()
    )
    user.follows("verify", code=3, shows=f"object-changed: the bytes of {name}")
    user.follows("recover", name, "saved.mcap", shows="recovered: 14 messages")


def test_a_record_that_is_damaged_outside_a_lake_comes_in_once_its_rest_is_saved(
    user: User,
) -> None:
    user.succeeds("export", "mcap", "--to", "out", "--where", "name = 'first'")
    (record,) = (user.folder / "out").glob("*.mcap")
    record.write_bytes(flipped(record.read_bytes()))
    user.meets(
        "record/record_checksums.py", "save the rest of it: flagdata recover", "ingest", record
    )
    user.follows("recover", record, "saved.mcap")
    user.succeeds("ingest", "saved.mcap")
    user.leaves(["verify"])


def test_a_record_that_was_cut_off_is_saved(user: User) -> None:
    cut = (user.folder / "cut.mcap").read_bytes()
    name = changed(user, "first", cut)
    user.meets("record/mcap_container.py", "run `flagdata recover` on the file", *STAMPS.split())
    user.follows("recover", name, "saved.mcap", shows="recovered")


def test_shards_are_raised_to_hold_a_recording(user: User) -> None:
    user.succeeds(*STAMPS.split())
    command = (
        "export",
        "webdataset",
        "--to",
        "out",
        "--where",
        "kind = 'recording'",
        "--shard-bytes",
    )
    user.meets("export/webdataset.py", "raise --shard-bytes", *command, 20_000)
    user.follows(*command, 10_000_000)
