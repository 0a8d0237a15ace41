"""The worker's protocol and life: what is sent comes back, lost workers are replaced, nothing is
left behind."""

import io
import os
import sys
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import CorruptError
from sim.blender import Message, RenderError, WorkerProcess, decode, encode
from sim.blender.protocol import PROTOCOL_VERSION

FAKE = Path(__file__).with_name("fake_worker.py")


def worker(folder: Path, mode: str = "none", at: str = "0", *, attempts: int = 3) -> WorkerProcess:
    return WorkerProcess(
        (sys.executable, str(FAKE), str(folder / "count"), mode, at), attempts=attempts
    )


def reader(data: bytes):
    stream = io.BytesIO(data)

    def read(count: int) -> bytes:
        part = stream.read(count)
        if len(part) < count:
            raise EOFError
        return part

    return read


def frames(count: int) -> list[Message]:
    return [
        Message(kind="frame", fields={"index": i}, arrays={"a": np.full(3, i)})
        for i in range(count)
    ]


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_message_comes_out_as_it_went_in():
    arrays = {
        "positions": np.arange(12, dtype=np.float32).reshape(4, 3),
        "faces": np.zeros((0, 3), dtype=np.int32),
        "texture": np.arange(255, dtype=np.uint8),
    }
    out = decode(reader(encode(Message(kind="frame", fields={"sun": [0.5, 1e-9]}, arrays=arrays))))
    assert out.kind == "frame"
    assert out.fields == {"sun": [0.5, 1e-9]}
    for name, values in arrays.items():
        assert out.arrays[name].dtype == values.dtype
        np.testing.assert_array_equal(out.arrays[name], values)


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"\xff\xff\xff\xff" + data[4:],
        lambda data: data[:4] + b"x" + data[5:],
        lambda data: data.replace(f'"version": {PROTOCOL_VERSION}'.encode(), b'"version": 9'),
        lambda data: data.replace(b'"float32"', b'"complex"'),
        lambda data: data.replace(b"[3]", b"[-]"),
    ],
    ids=["length", "json", "version", "type", "shape"],
)
def test_bytes_that_are_no_message_are_corrupt(damage):
    data = encode(Message(kind="frame", arrays={"a": np.zeros(3, dtype=np.float32)}))
    with pytest.raises(CorruptError):
        decode(reader(damage(data)))


def test_a_stream_that_ends_within_a_message_has_ended():
    data = encode(Message(kind="frame", arrays={"a": np.zeros(3, dtype=np.float32)}))
    with pytest.raises(EOFError):
        decode(reader(data[:-1]))


def test_messages_larger_than_a_pipe_are_answered(tmp_path):
    large = Message(kind="frame", arrays={"a": np.arange(1_000_000, dtype=np.float32)})
    with worker(tmp_path) as process:
        (answer,) = process.request([large], timeout=300)
    np.testing.assert_array_equal(answer.arrays["a"], large.arrays["a"])


@pytest.mark.parametrize(("mode", "timeout"), [("crash", 30.0), ("hang", 0.5)])
def test_a_lost_worker_is_replaced_and_its_frame_redone(tmp_path, mode, timeout):
    # The scene is request 1, frames 0 and 1 are 2 and 3; the worker is lost at frame 1.
    with worker(tmp_path, mode, "3") as process:
        setup = Message(kind="scene")
        process.request([setup], timeout=300)
        answers = process.request(frames(4), timeout=timeout, setup=setup)
        assert process.restarts == 1
    assert [answer.fields["index"] for answer in answers] == [0, 1, 2, 3]
    assert (
        tmp_path / "count"
    ).read_text() == "7"  # 5 asked once, frame 1 twice, the scene sent again


def test_a_worker_that_keeps_crashing_is_given_up_with_its_last_words(tmp_path):
    with (
        worker(tmp_path, "crash", "2+") as process,
        pytest.raises(RenderError, match="something went wrong in C"),
    ):
        process.request(frames(3), timeout=300)
    assert process.restarts == 3
    assert process.pid is None


def test_what_the_worker_refuses_is_not_tried_again(tmp_path):
    with worker(tmp_path, "refuse", "1") as process:
        with pytest.raises(RenderError, match="no such thing"):
            process.request(frames(1), timeout=300)
        assert process.restarts == 0
        assert process.request(frames(1), timeout=300)[0].fields["index"] == 0


def test_closing_ends_the_process_and_asking_again_starts_another(tmp_path):
    process = worker(tmp_path)
    process.request(frames(1), timeout=300)
    first = process.pid
    assert first is not None
    process.close()
    assert not alive(first)
    process.request(frames(1), timeout=300)
    assert process.pid not in (None, first)
    process.close()


def test_a_hung_worker_is_killed_when_it_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(
        "sim.blender.process.EXIT_TIMEOUT", 3600.0
    )  # a hung worker's end is not waited for
    process = worker(tmp_path, "hang", "2", attempts=1)
    process.request(frames(1), timeout=300)
    pid = process.pid
    assert pid is not None
    with pytest.raises(RenderError, match=r"did not answer for 0\.3 s"):
        process.request(frames(1), timeout=0.3)
    assert not alive(pid)
