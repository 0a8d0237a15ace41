"""Filed verdicts: written once, with a hash, before any key is opened."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from flagdata.core.files.outputs import rewrite
from flagdata.core.json_values import json_values
from flagdata.core.provenance import file_hash
from flagdata.errors import ConflictError, CorruptError, RefusedError
from flagdata.recipes.documents import read_json
from measure.report.document import SCHEMA
from measure.verdict import QUANTITY_ENTRIES, Verdict
from tests.studies.challenge.folder import ChallengeFolder, write_json


@dataclass(frozen=True, kw_only=True)
class Filing:
    """What a fitter said of a set.

    Attributes:
        name: of the set.
        data: hash of what it was given.
        seed: of its randomness.
        verdict: as JSON; None where it refused the data.
        refusal: kind, what, where and fix; None where there is a verdict.
        seconds: it took.
    """

    name: str
    data: str
    seed: int
    verdict: dict[str, Any] | None
    refusal: dict[str, str | None] | None
    seconds: float

    @property
    def criteria(self) -> str | None:
        """The hash of the thresholds that the verdict states; None where it states none."""
        stated = (self.verdict or {}).get("provenance", {}).get("criteria")
        return None if stated is None else str(stated["hash"])

    def as_dict(self) -> dict[str, Any]:
        """JSON values."""
        return {"schema": "flagdata.filing/1", **asdict(self)}


def verdict_json(verdict: Verdict) -> dict[str, Any]:
    """A verdict as JSON, None for numbers that are not finite."""
    return {"schema": SCHEMA, **json_values(verdict, names=QUANTITY_ENTRIES)}


def file(folder: ChallengeFolder, filing: Filing) -> None:
    """Write a verdict and its hash.

    Raises:
        ConflictError: the set has one, or its key was opened.
    """
    if filed(folder, filing.name) or filing.name in opened(folder):
        raise ConflictError(
            "a verdict is filed already, or the key was opened",
            where=f"{folder.path}, {filing.name}",
            fix="make a new challenge: a verdict is given once",
        )
    digest = write_json(folder.verdict(filing.name), filing.as_dict())
    rewrite(folder.verdict_hash(filing.name), digest + "\n")


def filed(folder: ChallengeFolder, name: str) -> bool:
    """Whether a set has a verdict; one without its hash was cut off and does not count."""
    return folder.verdict(name).is_file() and folder.verdict_hash(name).is_file()


def read(folder: ChallengeFolder, name: str) -> Filing:
    """A filed verdict, once it is found to be as it was filed.

    Raises:
        RefusedError: none was filed.
        CorruptError: it, its hash or the data it is about were changed since.
    """
    if not filed(folder, name):
        raise RefusedError(
            "no verdict was filed",
            where=f"{folder.path}, {name}",
            fix="run `python -m tests.studies challenge run` first",
        )
    path = folder.verdict(name)
    found = file_hash(path)
    kept = opened(folder).get(name, found)
    if folder.verdict_hash(name).read_text(encoding="utf-8").strip() != found or kept != found:
        raise CorruptError(
            "the verdict is not as it was filed",
            where=str(path),
            fix="restore it; nothing is scored",
        )
    content = read_json(path, noun="verdict")
    try:
        filing = Filing(**{key: value for key, value in content.items() if key != "schema"})
    except TypeError as error:
        raise CorruptError(
            f"not a filed verdict: {error}", where=str(path), fix="restore it"
        ) from None
    if filing.name != name or filing.data != folder.manifest()["sets"][name]["data"]:
        raise CorruptError(
            "the verdict is about other data", where=str(path), fix="restore it; nothing is scored"
        )
    return filing


def opened(folder: ChallengeFolder) -> Mapping[str, str]:
    """Set → hash of its verdict when its key was opened."""
    if not folder.opened.is_file():
        return {}
    verdicts = read_json(folder.opened, noun="record of openings").get("verdicts")
    if not isinstance(verdicts, dict):
        raise CorruptError(
            "the record of openings states no verdicts", where=str(folder.opened), fix="restore it"
        )
    return verdicts


def note_opening(folder: ChallengeFolder, names: list[str]) -> None:
    """Keep on record that keys are open, and what had been said by then."""
    verdicts = dict(opened(folder)) | {name: file_hash(folder.verdict(name)) for name in names}
    write_json(folder.opened, {"schema": "flagdata.challenge-opened/1", "verdicts": verdicts})
