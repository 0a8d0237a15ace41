"""The page in a browser: no error, no text over text, the cloth moves, and stands still for those
who ask for it."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from measure.verdict import Conclusion
from tests.measure.report.pages import page
from tests.measure.report.verdicts import FULL, verdict, with_holes

BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
pytestmark = pytest.mark.skipif(BROWSER is None, reason="no Chromium on the path")

# A clock of its own, 16 ms a frame: how many animation frames a headless browser shows depends on
# the load.
FRAMES = """
<script>
let clock = 0, waiting = [];
performance.now = () => clock;
window.requestAnimationFrame = (draw) => waiting.push(draw);
const frames = setInterval(() => {
  clock += 16;
  const due = waiting;
  waiting = [];
  for (const draw of due) draw(clock);
}, 16);
</script>
"""

# Looks at the page from inside and leaves what it saw in an element of its own.
PROBE = """
<script>
const look = () => {
  clearInterval(frames);
  const touching = [];
  for (const svg of document.querySelectorAll("svg")) {
    const boxes = [...svg.querySelectorAll("text")].map((t) => [t.textContent, t.getBoundingClientRect()]);
    for (let a = 0; a < boxes.length; a++) for (let b = a + 1; b < boxes.length; b++) {
      const [p, q] = [boxes[a][1], boxes[b][1]];
      const across = Math.min(p.right, q.right) - Math.max(p.left, q.left);
      const down = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
      if (across > 0.5 && down > 2) touching.push([boxes[a][0], boxes[b][0]]);
    }
  }
  const outside = [...document.querySelectorAll("svg")].flatMap((svg) => {
    const frame = svg.getBoundingClientRect();
    return [...svg.querySelectorAll("text")].filter((t) => {
      const box = t.getBoundingClientRect();
      return box.left < frame.left - 1 || box.right > frame.right + 1;
    }).map((t) => t.textContent);
  });
  const found = {
    touching, outside,
    wide: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    frame: Number(document.querySelector('[data-control="frame"]').value),
    button: document.querySelector('[data-control="play"]').textContent,
  };
  const probe = document.createElement("pre");
  probe.id = "probe";
  probe.textContent = JSON.stringify(found);
  document.body.append(probe);
};
const wait = (left) => requestAnimationFrame(() => left > 1 ? wait(left - 1) : look());
wait(56);
</script>
"""


def seen(html: str, folder: Path, *options: str) -> dict[str, object]:
    """What the probe saw, and the console's lines."""
    file = folder / "page.html"
    html = html.replace("<head>", "<head>" + FRAMES, 1).replace("</body>", PROBE + "</body>")
    file.write_text(html, encoding="utf-8")
    assert BROWSER
    done = subprocess.run(
        [
            BROWSER,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--window-size=1280,1000",
            "--enable-logging=stderr",
            "--virtual-time-budget=20000",
            f"--user-data-dir={folder / 'profile'}",
            *options,
            "--dump-dom",
            file.as_uri(),
        ],
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    match = re.search(r'<pre id="probe">(.*?)</pre>', done.stdout, re.DOTALL)
    assert match, done.stderr
    text = match[1].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
    return {
        **json.loads(text),
        "console": [line for line in done.stderr.splitlines() if "CONSOLE" in line],
    }


@pytest.mark.parametrize(
    "whole",
    [
        verdict(Conclusion.EFFECT, FULL),
        verdict(Conclusion.SUFFICIENT),
        with_holes(verdict(Conclusion.ONE_OF)),
    ],
    ids=["effect", "sufficient", "holes"],
)
def test_the_page_runs_without_an_error_and_no_text_lies_over_another(
    whole, tmp_path: Path
) -> None:
    found = seen(page(whole), tmp_path)
    assert found["console"] == []
    assert found["touching"] == []
    assert found["outside"] == []
    assert found["wide"] == 0
    assert found["button"] == "Pause"
    assert (
        found["frame"] == 5
    )  # 25 frames a second at a quarter of the speed, after 56 · 16 ms: 5.6


def test_the_cloth_stands_still_for_those_who_want_less_motion(tmp_path: Path) -> None:
    found = seen(page(verdict(Conclusion.EFFECT)), tmp_path, "--force-prefers-reduced-motion")
    assert (found["button"], found["frame"]) == ("Play", 0)


def test_the_page_fits_a_telephone(tmp_path: Path) -> None:
    found = seen(page(verdict(Conclusion.EFFECT)), tmp_path, "--window-size=500,900")
    assert found["wide"] == 0
    assert found["touching"] == []
