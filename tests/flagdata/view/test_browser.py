"""The pages in a browser, at the width of a desk and of a telephone: the film plays, and the cursor
goes along."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.flagdata.view.browser import BROWSER, asked
from tests.flagdata.view.conftest import Shown

pytestmark = pytest.mark.skipif(BROWSER is None, reason="no Chromium on the path")
_PLAYED = """
  const picture = document.querySelector("canvas.picture"), plot = document.querySelector(".player canvas.plot");
  await until(() => picture.dataset.frame === "0");
  document.querySelector('[data-control="play"]').click();
  await until(() => Number(picture.dataset.frame) >= 20);
  document.querySelector('[data-control="play"]').click();
  await new Promise((go) => setTimeout(go, 200));
  const frame = Number(picture.dataset.frame), cursor = Number(plot.dataset.cursor);
  const box = plot.getBoundingClientRect();
  const end = { clientX: box.right - 5, clientY: box.top + 50, bubbles: true };
  plot.dispatchEvent(new PointerEvent("pointerdown", end));
  await until(() => Number(picture.dataset.frame) > 140);
  const inked = (canvas) => {
    const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    const values = new Set();
    for (let i = 0; i < data.length; i += 4) values.add(data[i]);
    return values.size;
  };
  const reading = document.querySelector(".reading").textContent;
  return { frame, cursor, sought: Number(picture.dataset.frame), reading,
    picture: [picture.width, picture.height, inked(picture)],
    evidence: [...document.querySelectorAll(".evidence canvas")].map((one) => Number(one.dataset.cursor)),
    missing: [...document.querySelectorAll(".card img")].filter((one) => !one.naturalWidth).length };
"""
_TILES = """
  await until(() => [...document.querySelectorAll(".card img")].every((one) => one.complete));
  return { missing: [...document.querySelectorAll(".card img")].filter((one) => !one.naturalWidth).length };
"""


@pytest.mark.parametrize("width", [1200, 400])
def test_the_film_plays_with_the_cursor_on_its_wind_and_nothing_is_asked_elsewhere(
    shown: Shown, tmp_path: Path, width: int
) -> None:
    found = asked(shown.lake, f"artifact/{shown.recording}", _PLAYED, folder=tmp_path, width=width)
    assert found["refused"] == []
    assert {host.split(":")[0] for host in found["requests"]} == {"127.0.0.1"}
    assert (found["wide"], found["width"]) == (0, width)
    assert found["cursor"] == pytest.approx(found["frame"] * 0.04, abs=1e-3)
    assert found["picture"][:2] == [64, 48]
    assert found["picture"][2] > 50
    assert found["sought"] == 149
    assert "frame 150 of 150 · wind 4.6" in found["reading"]
    assert found["evidence"] == [0, 0]
    assert found["missing"] == 0


def test_the_overview_fits_a_telephone(shown: Shown, tmp_path: Path) -> None:
    found = asked(shown.lake, "", _TILES, folder=tmp_path, width=400)
    assert (found["wide"], found["width"], found["missing"], found["refused"]) == (0, 400, 0, [])
