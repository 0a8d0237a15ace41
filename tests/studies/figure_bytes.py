"""Pictures of matplotlib's figures, for reports of studies."""

from __future__ import annotations

import io

from matplotlib.figure import Figure


def png(figure: Figure, *, dpi: float = 110) -> bytes:
    """Writes the figure as a PNG that does not name the program it was drawn by."""
    target = io.BytesIO()
    figure.savefig(target, format="png", dpi=dpi, metadata={"Software": None})
    return target.getvalue()
