"""The same clips read by flagdata and by other programs, each in a process, and an environment, of
its own.

Clips of 30 gray frames of 300×300. flagdata, plain files, WebDataset, Lance and Rerun hold the same
JPEG bytes; LeRobot holds films in AV1. Cold means that the system was asked to forget the files
before; other reads are of a second pass. Every process decodes with one thread, by simplejpeg where
its environment has it, else by Pillow. A peer that is not installed, and what a peer does not
offer, is left out with the reason.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import flagdata
from flagdata.core.schema import CLIP_FRAMES
from flagdata.errors import FlagdataError
from flagdata.export import Export, export
from flagdata.lake import Lake
from flagdata.record import Record
from tests.s3 import BUCKET, SECRETS, moto
from tests.studies.benchmarks.bench_pairs import make_recording, make_shards
from tests.studies.validation.environments import DATASETS, LANCE, LEROBOT, Environment

CLIPS = int(os.environ.get("FLAGDATA_BENCH_CLIPS", "60"))
WORKERS = (2, 4)
_CLIPS_ONLY = "kind = 'clip'"

# What each program's text defines: `opened(place)` → (get(index), all()), either may be None.
_MEASURE = """
import io, json, random, sys, time
began = time.perf_counter()
place, count, workers, ways = sys.argv[1], int(sys.argv[2]), [int(n) for n in sys.argv[3].split(",")], sys.argv[4]
import numpy as np
try:
    import simplejpeg
    def decoded(data): return simplejpeg.decode_jpeg(data, colorspace="GRAY")[..., 0]
except ImportError:
    from PIL import Image
    def decoded(data): return np.asarray(Image.open(io.BytesIO(data)).convert("L"))
{program}
imported = time.perf_counter()
get, everything = opened(place)
order = random.Random(0).sample(range(count), count)
if get is not None and ways != "sequential":
    first = get(order[0])
else:
    first = next(iter(everything()))
assert tuple(np.shape(first))[-3:] == (30, 300, 300), np.shape(first)
found = {"import_s": imported - began, "first_clip_s": time.perf_counter() - imported}
def rate(clips):
    wall, cpu, n = time.perf_counter(), time.process_time(), 0
    for _ in clips: n += 1
    return {"clips_s": n / (time.perf_counter() - wall), "clips_cpu_s": n / max(time.process_time() - cpu, 1e-9)}
if get is not None and ways != "sequential":
    found["random, first pass"] = rate(get(i) for i in order)
    found["random, warm"] = rate(get(i) for i in order)
    found["sequential, warm"] = rate(get(i) for i in range(count))
else:
    found["sequential, first pass"] = rate(everything())
    found["sequential, warm"] = rate(everything())
if get is not None and workers != [0]:
    try:
        import torch
        class Clips(torch.utils.data.Dataset):
            def __len__(self): return count
            def __getitem__(self, index): return torch.as_tensor(np.asarray(get(index)))
        import warnings
        warnings.simplefilter("ignore")
        for n in workers:
            loader = torch.utils.data.DataLoader(Clips(), batch_size=1, num_workers=n, sampler=order,
                                                 multiprocessing_context="fork", persistent_workers=True)
            rate(loader)
            found[f"random, {n} workers"] = {"clips_s": rate(loader)["clips_s"]}
    except ImportError:
        found["workers"] = "left out: its environment has no torch"
with open("/proc/self/status") as status:
    found["peak_MiB"] = int(next(line for line in status if line.startswith("VmHWM")).split()[1]) // 1024
print(json.dumps(found))
"""
_FLAGDATA = """
import torch
torch.set_num_threads(1)
import flagdata, flagdata.dataset.resolve
def opened(place):
    pairs = flagdata.open(place).pairs()
    return (lambda index: pairs[index].clip[0]), None
"""
_CACHED = """
import torch
torch.set_num_threads(1)
import flagdata, flagdata.dataset.resolve
from flagdata.dataset import DecodedCache
def opened(place):
    pairs = flagdata.open(place).pairs(cache=DecodedCache(place + "-cache", limit=2 << 30))
    return (lambda index: pairs[index].clip[0]), None
"""
_FILES = """
from pathlib import Path
def opened(place):
    def get(index):
        return np.stack([decoded((Path(place) / f"{index:06d}" / f"{k:02d}.jpg").read_bytes()) for k in range(30)])
    return get, None
"""
_WEBDATASET = """
import glob, webdataset
def opened(place):
    shards = sorted(glob.glob(place + "/*.tar"))
    def clip(sample): return np.stack([decoded(sample[f"{k:02d}.jpg"]) for k in range(30)])
    def everything(): return webdataset.WebDataset(shards, shardshuffle=False, empty_check=False).map(clip)
    return None, everything
"""
_LANCE = """
import lance, os
OPTIONS = json.loads(os.environ.get("BENCH_LANCE", "null"))
def opened(place):
    data = lance.dataset(place, storage_options=OPTIONS)
    def get(index):
        return np.stack([decoded(frame) for frame in data.take([index], columns=["frames"])["frames"][0].as_py()])
    return get, None
"""
_LANCE_WRITE = """
import json, os, sys, lance, pyarrow as pa
from pathlib import Path
clips = sorted(Path(sys.argv[1]).iterdir())
frames = [[file.read_bytes() for file in sorted(clip.iterdir())] for clip in clips]
lance.write_dataset(pa.table({"frames": pa.array(frames, pa.list_(pa.binary()))}), sys.argv[2],
                    storage_options=json.loads(os.environ.get("BENCH_LANCE", "null")))
"""
_RERUN = """
from rerun.chunk import McapReader
def opened(place):
    import glob
    (file,) = glob.glob(place + "/*.mcap")
    def everything():
        frames = []
        for chunk in McapReader(file).stream():
            rows = chunk.to_record_batch()
            if "EncodedImage:blob" in rows.schema.names:
                for value in rows.column(rows.schema.names.index("EncodedImage:blob")):
                    if value.is_valid:
                        frames.append(decoded(value[0].values.to_numpy().tobytes()))
                        if len(frames) == 30:
                            yield np.stack(frames)
                            frames = []
    return None, everything
"""
_LEROBOT = """
from lerobot.datasets.lerobot_dataset import LeRobotDataset
KEY = "observation.images.camera"
def opened(place):
    data = LeRobotDataset("bench/clips", root=place, video_backend="pyav",
                          delta_timestamps={KEY: [k / 25 for k in range(30)]})
    return (lambda index: data[30 * index][KEY][:, 0]), None
"""


@dataclass(frozen=True, kw_only=True)
class Peer:
    """A program that reads clips.

    Attributes:
        title: of it.
        program: its text, see `_MEASURE`.
        place: of its data.
        environment: that has it; this one if `None`.
        variables: of its process.
        remarks: what it does not offer, by figure.
    """

    title: str
    program: str
    place: str
    environment: Environment | None = None
    variables: dict[str, str] = field(default_factory=dict)
    remarks: dict[str, str] = field(default_factory=dict)

    def python(self) -> str:
        """Raises: NotFoundError, UnusableError: it is not installed."""
        return sys.executable if self.environment is None else str(self.environment.find())


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Clips a second, seconds to the first clip and memory, by peer and place."""
    del out
    found: dict[str, Any] = {"clips": CLIPS, "load_average": round(os.getloadavg()[0], 1)}
    with tempfile.TemporaryDirectory() as name, moto() as address:
        folder = Path(name)
        lake = Lake.create(folder / "lake")
        make_recording(lake, seed, clips=CLIPS)
        frames = _write_files(lake, folder / "files")
        found["bytes a frame"] = round(frames / CLIPS / CLIP_FRAMES)
        found["a disk"] = {peer.title: _measured(peer, folder) for peer in _on_disk(lake, folder)}
        found["a bucket on loopback"] = {
            peer.title: _measured(peer, folder) for peer in _in_bucket(folder, address)
        }
    return found


def _write_files(lake: Lake, folder: Path) -> int:
    """A folder a clip, a file a frame; bytes of all."""
    pairs, size = flagdata.open(lake.path).pairs(), 0
    record = Record.open(lake.object_path(str(pairs.table.objects[0])))
    for index in range(len(pairs)):
        place = folder / f"{index:06d}"
        place.mkdir(parents=True)
        for k, data in enumerate(record.jpegs(int(pairs.table.frame_first[index]), CLIP_FRAMES)):
            size += (place / f"{k:02d}.jpg").write_bytes(data)
    make_shards(folder.parent / "shards", lake, pairs)
    return size


def _on_disk(lake: Lake, folder: Path) -> Iterator[Peer]:
    yield Peer(title="flagdata, JPEG", program=_FLAGDATA, place=str(lake.path))
    yield Peer(title="flagdata, decoded cache", program=_CACHED, place=str(lake.path))
    yield Peer(title="plain files", program=_FILES, place=str(folder / "files"))
    shards = {"random": "left out: WebDataset reads shards in their order"}
    yield Peer(
        title="WebDataset", program=_WEBDATASET, place=str(folder / "shards"), remarks=shards
    )
    if _is_there(LANCE):
        _write_lance(folder, str(folder / "lance"), {})
    yield Peer(title="Lance", program=_LANCE, place=str(folder / "lance"), environment=LANCE)
    whole = {"random": "left out: Rerun's reader of MCAP streams whole files"}
    if _is_there(DATASETS):
        export(lake, Export(format="mcap", where="kind = 'recording'"), folder / "mcap")
    yield Peer(
        title="Rerun",
        program=_RERUN,
        place=str(folder / "mcap"),
        environment=DATASETS,
        remarks=whole,
        variables={"HOME": str(folder)},
    )
    if _is_there(LEROBOT):
        export(
            lake,
            Export(format="lerobot", where=_CLIPS_ONLY, options={"frames": "av1"}),
            folder / "lerobot",
        )
    home = {
        "HF_HUB_OFFLINE": "1",
        "HF_DATASETS_OFFLINE": "1",
        "HOME": str(folder),
        "HF_HOME": str(folder / "hf"),
    }
    yield Peer(
        title="LeRobot, AV1",
        program=_LEROBOT,
        place=str(folder / "lerobot"),
        environment=LEROBOT,
        variables=home,
    )


def _in_bucket(folder: Path, address: str) -> Iterator[Peer]:
    keys = {**SECRETS, "AWS_REGION": "us-east-1", "AWS_ENDPOINT_URL": address}
    remote = f"s3://{BUCKET}/lake"
    copy = "import sys; from flagdata.cli import main; main()"
    clone = [sys.executable, "-c", copy, "clone", str(folder / "lake"), remote]
    subprocess.run(clone, check=True, stdout=subprocess.DEVNULL, env=_variables(keys))
    cache = {"FLAGDATA_CACHE": str(folder / "cache-of-objects")}
    yield Peer(title="flagdata, JPEG", program=_FLAGDATA, place=remote, variables={**keys, **cache})
    lower = {name.lower(): value for name, value in SECRETS.items()}
    options = {**lower, "aws_region": "us-east-1", "aws_endpoint": address, "allow_http": "true"}
    said = {"BENCH_LANCE": json.dumps(options)}
    if _is_there(LANCE):
        _write_lance(folder, f"s3://{BUCKET}/lance", said)
    yield Peer(
        title="Lance",
        program=_LANCE,
        place=f"s3://{BUCKET}/lance",
        environment=LANCE,
        variables=said,
    )


def _is_there(environment: Environment) -> bool:
    try:
        environment.find()
    except FlagdataError:
        return False
    return True


def _write_lance(folder: Path, place: str, variables: dict[str, str]) -> None:
    command = [str(LANCE.find()), "-I", "-c", _LANCE_WRITE, str(folder / "files"), place]
    subprocess.run(command, check=True, env=_variables(variables))


def _measured(peer: Peer, folder: Path) -> dict[str, Any] | str:
    try:
        python = peer.python()
    except FlagdataError as error:
        return f"left out: {error.what}"
    _forget(folder)
    workers = ",".join(map(str, WORKERS)) if "random" not in peer.remarks else "0"
    command = [
        python,
        *([] if peer.environment is None else ["-I"]),
        "-c",
        _MEASURE.replace("{program}", peer.program),
    ]
    done = subprocess.run(
        [*command, peer.place, str(CLIPS), workers, "sequential" if peer.remarks else "random"],
        capture_output=True,
        text=True,
        check=False,
        env=_variables(peer.variables),
    )
    if done.returncode:
        return f"failed: {done.stderr.strip().splitlines()[-1]}"
    return {**json.loads(done.stdout.splitlines()[-1]), **peer.remarks}


def _variables(more: dict[str, str]) -> dict[str, str]:
    own = {name: value for name, value in os.environ.items() if not name.startswith("AWS_")}
    return {**own, **more}


def _forget(folder: Path) -> None:
    """Ask the system to drop what it keeps of files in memory."""
    for path in folder.rglob("*"):
        if path.is_file():
            with path.open("rb") as stream:
                os.posix_fadvise(stream.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
