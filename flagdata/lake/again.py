"""How an artifact is made again whose object is damaged or missing: the remedy that a finding names."""

from __future__ import annotations

import shlex

from flagdata.lake.artifact import Artifact
from flagdata.lake.refs import MAIN
from flagdata.printable import SHORT
from flagdata.schema import Kind

_BY_KIND = {
    Kind.MESHES: "simulate or build its recipe again",
    Kind.RECORDING: "align, declare or build it again as before",
    Kind.CLIP: "align, declare or build its recording again as before",
    Kind.NETWORK: "train it again",
    Kind.WIND: "align or declare it again as before",
}
"""Of what has no file that it was ingested from."""


def made_again(artifact: Artifact) -> str:
    """What replaces the object of an artifact that is damaged or missing."""
    branch = "" if artifact.branch == MAIN else f" --branch {artifact.branch}"
    if artifact.kind in (Kind.MEASUREMENT, Kind.MODEL):
        withdraw = f"flagdata withdraw {artifact.id[:SHORT]}{branch} -m 'its data are lost'"
        return (
            f"give the command that made it again by the same code ({artifact.code_version}), which replaces the "
            f"object; or flagdata pull a clone of this lake, restore it from a copy, or {withdraw}"
        )
    if artifact.source_name is not None:
        how = f"flagdata ingest {shlex.quote(artifact.source_name)}{branch} again, with the options of the first time"
    else:
        how = f"{_BY_KIND.get(artifact.kind, 'give the command that made it again')}{branch and f', with{branch}'}"
    return f"{how}: it replaces the object; or flagdata pull a clone of this lake, or restore it from a copy"
