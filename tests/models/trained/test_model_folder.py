"""A model is used only if its files are as they were written; cards that are no cards are
refused."""

from __future__ import annotations

import errno
import hashlib
import shutil
from pathlib import Path

import pytest
import torch

from flagdata.core.files.checksums import SUMS, content_hash
from flagdata.errors import CorruptError, FlagdataError
from models.trained import estimator
from models.trained.estimator import CLOUD, SHIPPED
from models.trained.model_folder import CARD, WEIGHTS, check_model, renew, write_tensors

FILES = (CARD, WEIGHTS, CLOUD, "gate.safetensors", SUMS)


def flip(path: Path, *, share: float) -> None:
    """Change one bit of a file, that far into it."""
    content = bytearray(path.read_bytes())
    content[int(share * (len(content) - 1))] ^= 1
    path.write_bytes(content)


@pytest.fixture
def shipped(tmp_path: Path) -> Path:
    return Path(shutil.copytree(SHIPPED / "wave-cloth", tmp_path / "wave-cloth"))


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("share", [0.3, 0.999])
def test_one_bit_in_any_file_of_a_model_is_found_before_it_is_used(
    shipped: Path, name: str, share: float
) -> None:
    assert estimator.load(shipped).name == "wave-cloth"
    flip(shipped / name, share=share)
    with pytest.raises(CorruptError):
        estimator.load(shipped)


@pytest.mark.parametrize("name", ["flow-outdoor", "flow-world", "flow", "wave", "wave-cloth"])
def test_every_model_that_comes_with_the_package_states_its_checksums(name: str) -> None:
    check_model(SHIPPED / name)


@pytest.mark.parametrize("name", ["flow-outdoor", "flow-world", "flow", "wave", "wave-cloth"])
def test_a_models_distribution_in_closed_form_is_the_one_that_it_draws_from(name: str) -> None:
    model = estimator.load_shipped(name)
    generator = torch.Generator().manual_seed(0)
    embeddings = [torch.randn((3, 32), generator=generator) for _ in model.learners]
    drawn, posterior = (
        model.logits(embeddings, seed=1, draws=100_000).double(),
        model.posterior(embeddings),
    )
    spread = posterior.covariance().diagonal(dim1=-2, dim2=-1).sqrt()
    difference = (drawn.mean(dim=1) - posterior.mean()) / spread
    assert float(difference.abs().max()) < 4 / 100_000**0.5
    assert float((drawn.std(dim=1) / spread - 1).abs().max()) < 0.02


def test_a_model_of_a_lake_is_held_to_the_hash_in_its_name(shipped: Path) -> None:
    """As lakes hold models that were trained before models had checksums of their own."""
    (shipped / SUMS).unlink()
    lines = "".join(
        f"{hashlib.sha256((shipped / n).read_bytes()).hexdigest()}  {n}\n"
        for n in sorted(FILES[:4])
    )
    stored = shipped.rename(
        shipped.with_name(f"{hashlib.sha256(lines.encode()).hexdigest()}.model")
    )
    assert content_hash(stored) == stored.stem
    assert estimator.load(stored).name == "wave-cloth"
    flip(stored / WEIGHTS, share=0.5)
    with pytest.raises(CorruptError, match="have changed since it was stored"):
        estimator.load(stored)


def test_a_model_that_nothing_vouches_for_is_refused_with_how_to_state_it(shipped: Path) -> None:
    (shipped / SUMS).unlink()
    with pytest.raises(CorruptError, match="SHA256SUMS") as caught:
        estimator.load(shipped)
    assert "sha256sum * > SHA256SUMS" in caught.value.fix


def test_renewing_one_file_states_no_other_anew(shipped: Path) -> None:
    flip(shipped / WEIGHTS, share=0.5)
    renew(shipped, CLOUD, b"written anew")
    assert (shipped / CLOUD).read_bytes() == b"written anew"
    with pytest.raises(CorruptError) as caught:
        check_model(shipped)
    assert caught.value.where == str(shipped / WEIGHTS)


def test_a_file_that_cannot_be_renewed_stays_whole(
    shipped: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = {path.name: path.read_bytes() for path in shipped.iterdir()}

    def full(path: Path, data: bytes) -> int:
        with path.open("wb") as file:
            file.write(data[:10])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(FlagdataError, match="No space left"):
        renew(shipped, "gate.safetensors", b"another gate of many bytes")
    assert {path.name: path.read_bytes() for path in shipped.iterdir()} == before
    check_model(shipped)


def test_a_full_disk_is_an_error_of_the_system_with_its_number() -> None:
    """safetensors has an exception of its own for it, which nothing above would know."""
    with pytest.raises(OSError) as caught:
        write_tensors(Path("/dev/full"), {"weight": torch.zeros(1000)})
    assert caught.value.errno == errno.ENOSPC
