"""Why a window does not show an observable."""

from __future__ import annotations

NO_SILHOUETTE, NO_MOTION, NO_WAVE = "no-silhouette", "no-motion", "no-wave"
EDGE_ON, FEW_FRAMES = "edge-on", "few-frames"

REASONS = {
    NO_SILHOUETTE: "the cloth's outline was not found in enough frames",
    NO_MOTION: "the free edge hardly moves, so that its spectrum is noise",
    NO_WAVE: "no wave travels along the chord: the phases at its sections do not belong together",
    EDGE_ON: (
        "the flag flies towards the camera or away from it: hardly any of it is in the picture"
    ),
    FEW_FRAMES: "the window has fewer frames than the observable takes",
}
"""Kind of reason, by which windows are counted → a sentence for people."""


class UnseenError(Exception):
    """A definition finds nothing to measure in a window.

    Args:
        kind: of `REASONS`.
    """

    def __init__(self, kind: str) -> None:
        self.kind = kind
        super().__init__(REASONS[kind])
