"""The report of a joint answer as one page, which links to the report of each kind beside it."""

from __future__ import annotations

from flagdata.pages.render import render
from measure.closing.joint import Joint
from measure.report.page import FILTERS, TONES
from measure.report.sentences import after_label


def joint_page(joint: Joint) -> str:
    """The page, HTML; it lies beside the folders `markers` and `films`."""
    kinds = [
        {"name": name, "verdict": own, "after_label": after_label(own) if own.named else ""}
        for name, own in (("markers", joint.markers), ("films", joint.films))
    ]
    values = {"joint": joint, "tone": TONES[joint.conclusion], "kinds": kinds}
    return render("measure.report", "joint.html.j2", values, filters=FILTERS)
