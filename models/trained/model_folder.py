"""Models as folders: weights in safetensors, a card in JSON. Nothing in them is executed when they
are read.

card.json            what it is: recipe, data, seeds, scores, limits; "format" is `FORMAT`
weights.safetensors  the learner's parameters and buffers
…                    more tensors or pictures
SHA256SUMS           of all of these, checked before any of them is used; see `flagdata.checksums`
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor

from flagdata.core.files.checksums import SUMS, check_sums, content_hash, renewed_sums
from flagdata.core.files.durable import HEAL
from flagdata.core.files.outputs import rewrite
from flagdata.errors import CorruptError, LimitError, NotFoundError
from flagdata.recipes.documents import read_json

FORMAT = "flagdata.network/1"
CARD = "card.json"
WEIGHTS = "weights.safetensors"
TENSORS_LIMIT = 1 << 32
"""Largest file of tensors that is read [B]."""
_OBJECT = re.compile(r"([0-9a-f]{64})\.model")


def check_model(folder: Path) -> None:
    """Checks that the files of a model are as they were written.

    Models of a lake are checked by the hash in their name; others by their checksums.

    Raises:
        NotFoundError: there is no model.
        CorruptError: a file has changed, is missing or was added, or nothing states what the files
            should hold.
    """
    resolved = folder.resolve()
    if not (resolved / CARD).is_file():
        raise NotFoundError("there is no model here", where=str(folder), fix="name a trained model")
    if stored := _OBJECT.fullmatch(resolved.name):
        if content_hash(resolved) != stored[1]:
            raise CorruptError(
                "the model's files have changed since it was stored", where=str(folder), fix=_AGAIN
            )
    elif not (resolved / SUMS).is_file():
        raise CorruptError(
            f"the model has no {SUMS}, so that damage to it cannot be found",
            where=str(folder),
            fix="name it by its lake, or state that its files are whole: (cd FOLDER && sha256sum "
            f"* > {SUMS})",
        )
    else:
        check_sums(resolved, fix=_AGAIN)


def renew(folder: Path, name: str, content: bytes) -> None:
    """Replaces a file of a stored model, or adds one, and states its checksum. Each of the two
    files is the old one or the new one at any time; a process that is killed between them leaves a
    model that is refused by the file's name.

    Raises:
        CorruptError: the model's checksums cannot be read.
        FlagdataError: what the disk refuses.
    """
    sums = renewed_sums(folder, name, content)
    rewrite(folder / name, content)
    rewrite(folder / SUMS, sums)


def card_bytes(card: Mapping[str, Any]) -> bytes:
    """Encodes the card of a model as it is stored."""
    text = json.dumps({"format": FORMAT, **card}, indent=2, allow_nan=False, ensure_ascii=False)
    return f"{text}\n".encode()


def write_card(folder: Path, card: Mapping[str, Any]) -> None:
    """Writes the card of a model."""
    (folder / CARD).write_bytes(card_bytes(card))


def read_card(folder: Path) -> dict[str, Any]:
    """Reads the card of the model in a folder.

    Raises:
        NotFoundError: there is none.
        CorruptError: it is damaged, larger than any card, or of another format.
    """
    path = folder / CARD
    if not path.is_file():
        raise NotFoundError("there is no model here", where=str(folder), fix="name a trained model")
    card = read_json(path, noun="model's card", fix=_AGAIN)
    if card.get("format") != FORMAT:
        raise CorruptError("the card is of another format", where=str(path), fix=_AGAIN)
    return card


def tensor_bytes(tensors: Mapping[str, Tensor]) -> bytes:
    """Tensors by name as they are stored; each is copied, so that views are stored whole."""
    return save(
        {name: tensor.detach().cpu().contiguous().clone() for name, tensor in tensors.items()}
    )


def write_tensors(path: Path, tensors: Mapping[str, Tensor]) -> None:
    """Writes tensors by name.

    Raises:
        OSError: what the disk refuses.
    """
    path.write_bytes(tensor_bytes(tensors))


def read_tensors(path: Path) -> dict[str, Tensor]:
    """Tensors by name.

    Raises:
        NotFoundError: no such file.
        CorruptError: it is cut off or damaged, or holds numbers that are not finite.
        LimitError: larger than `TENSORS_LIMIT`.
    """
    if not path.is_file():
        raise NotFoundError(
            "there are no weights here", where=str(path), fix="name a trained model"
        )
    try:
        if (size := path.stat().st_size) > TENSORS_LIMIT:
            raise LimitError(
                f"the file has {size} bytes",
                where=str(path),
                fix=f"at most {TENSORS_LIMIT} are read",
            )
        tensors = load(path.read_bytes())
    except (SafetensorError, OSError, ValueError) as error:
        raise CorruptError(
            f"the weights cannot be read: {error}", where=str(path), fix=_AGAIN
        ) from None
    for name, tensor in tensors.items():
        if not bool(tensor.isfinite().all()):
            raise CorruptError(
                f"{name} holds numbers that are not finite", where=str(path), fix=_AGAIN
            )
    return tensors


_AGAIN = f"train it again; or, where it is of a lake, {HEAL}"
