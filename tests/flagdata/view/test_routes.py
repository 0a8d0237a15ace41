"""Addresses and their answers: what each page shows, that names are escaped, and that bad input is
a clear refusal."""

from __future__ import annotations

import html
import io
import json
import re
from dataclasses import replace
from urllib.parse import quote

import numpy as np
import pytest
from PIL import Image

from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake, keep
from flagdata.view import ServerAnswer, answer
from tests.flagdata.view.conftest import CURVE, NAME, Shown


def text(shown: Shown, address: str, *, status: int = 200) -> str:
    """The page at an address, which has that status."""
    found = answer(shown.site, f"/key/{address}")
    assert found.status == status, found.content.decode()
    return found.content.decode()


def cards(page: str) -> list[str]:
    return re.findall(r'class="card k-\w+" href="/key/artifact/(\w+)', page)


def pictures(found: ServerAnswer) -> list[bytes]:
    """The JPEGs of an answer, each behind its length."""
    stream, parts = io.BytesIO(found.content), []
    while head := stream.read(4):
        parts.append(stream.read(int.from_bytes(head, "big")))
    return parts


def test_the_overview_lists_artifacts_but_clips_and_filters_by_kind_and_name(shown: Shown) -> None:
    assert set(cards(text(shown, ""))) == {shown.recording, shown.meshes, shown.network}
    assert cards(text(shown, "?kind=clip")) == [shown.clip]
    assert cards(text(shown, "?name=CLOTH")) == [shown.meshes]
    assert cards(text(shown, "?kind=clip&name=cloth")) == []
    assert "did you mean &#39;clip&#39;" in text(shown, "?kind=clp", status=400)
    assert cards(text(shown, "?page=7&kind=clip")) == [shown.clip]
    assert "no number of a page" in text(shown, "?page=-1", status=400)


def test_the_page_of_a_result_lists_its_versions_with_the_code_of_each(shown: Shown) -> None:
    lake = shown.site.lake
    result = Artifact(
        kind=Kind.MEASUREMENT, name="wind", parents=[shown.recording], code_version="0.1.0+aaaaaaa"
    )
    ids = [
        keep(
            lake, one, lambda staged: (staged.mkdir(), (staged / "x").write_text("y")), "measure"
        ).artifact.id
        for one in (result, replace(result, code_version="0.1.0+<b>"))
    ]
    says = "wind 4.2 m/s [2.9, 5.8] 90 % <b>"
    told = replace(
        result, code_version="0.1.0+c", report=json.dumps({"sentence": says, "findings": []})
    )
    weighed = keep(
        lake, told, lambda staged: (staged.mkdir(), (staged / "x").write_text("y")), "measure"
    ).artifact.id
    for address in ("?kind=measurement", f"artifact/{weighed}"):
        assert html.escape(says) in text(shown, address)
    page = text(shown, f"artifact/{ids[1]}")
    assert f"{ids[0][:12]} by code 0.1.0+aaaaaaa" in page
    assert f"{ids[1][:12]} by code 0.1.0+&lt;b&gt;, this one" in page
    assert "by code" not in text(shown, f"artifact/{shown.recording}")


def test_names_texts_and_queries_of_others_are_escaped(shown: Shown) -> None:
    for address in ("", f"artifact/{shown.recording}", "?name=<b>"):
        page = text(shown, address)
        assert html.escape(NAME) in page or address == "?name=<b>"
        assert "<b>&amp;</b>" not in page
        assert "<i>two</i>" not in page
    assert '<script>"' not in text(
        shown, "query?sql=" + quote('select 1 as "<script>"'), status=200
    )
    assert "<script>x" not in text(shown, "query?sql=" + quote("<script>x"), status=400)
    assert "<script>x" not in text(shown, "?at=" + quote('"><script>x'), status=404)


def test_the_page_of_an_artifact_shows_film_clips_alignment_findings_and_lineage(
    shown: Shown,
) -> None:
    page = text(shown, f"artifact/{shown.recording}")
    assert cards(page) == [shown.clip]
    assert f'data-series="/key/series/{shown.recording}"' in page
    assert f'data-evidence="/key/evidence/{shown.recording}"' in page
    assert html.escape("<i>two</i>") in page
    linked = re.findall(r'<a href="/key/artifact/(\w+)"><title>', page)
    assert set(linked) == {shown.recording, shown.clip, shown.network}
    of_network = text(shown, f"artifact/{shown.network}")
    assert "data-series" not in of_network
    shown.lake.tag("v1")
    assert "<dt>σ of the offset</dt><dd>0.2 s</dd>" in page
    at_tag = text(shown, f"artifact/{shown.clip}?at=v1")
    assert f"/key/artifact/{shown.recording}?at=v1" in at_tag
    assert f"/key/artifact/{shown.recording}&#34;" not in at_tag


@pytest.mark.parametrize(
    ("address", "status"),
    [
        ("artifact/" + "0" * 32, 404),
        ("artifact/../../etc/passwd", 404),
        ("artifact/%2e%2e%2flake.json", 404),
        ("mcap/x.mcap", 404),
        ("thumbnail/xyz", 404),
        ("?at=nothing", 404),
        ("?at=99", 404),
        ("?a=1&b=1&c=1&d=1&e=1&f=1&g=1&h=1&i=1", 400),
        ("?name=%ff", 400),
        ("query?sql=drop+table+catalog", 400),
    ],
)
def test_what_is_not_there_or_cannot_be_asked_is_refused_with_what_to_do(
    shown: Shown, address: str, status: int
) -> None:
    page = text(shown, address, status=status)
    assert "verdict missed" in page
    assert str(shown.lake.path) not in page.replace("flagdata.lake", "") or "href" in page


def test_a_path_outside_the_key_is_not_found_and_does_not_show_the_key(shown: Shown) -> None:
    found = answer(shown.site, "/other/")
    assert found.status == 404


def test_frames_come_as_they_are_stored_and_a_clip_has_its_own(shown: Shown) -> None:
    site = shown.site
    whole = pictures(answer(site, f"/key/frames/{shown.recording}/128"))
    assert whole == list(shown.jpegs[128:150])
    assert len(pictures(answer(site, f"/key/frames/{shown.recording}/0"))) == 64
    assert pictures(answer(site, f"/key/frames/{shown.clip}/0")) == list(shown.jpegs[30:60])
    assert answer(site, f"/key/frames/{shown.clip}/30").status == 400
    assert answer(site, f"/key/frames/{shown.network}/0").status == 404


def test_a_thumbnail_is_the_middle_frame_and_is_gone_once_the_film_is_erased(shown: Shown) -> None:
    site = shown.site
    found = answer(site, f"/key/thumbnail/{shown.recording}")
    assert found.media_type == "image/jpeg"
    with (
        Image.open(io.BytesIO(found.content)) as small,
        Image.open(io.BytesIO(shown.jpegs[75])) as stored,
    ):
        assert small.size == stored.size == (64, 48)
        assert (
            np.abs(np.asarray(small, float) - np.asarray(stored, float)).mean() < 3
        )  # encoded twice
    shown.lake.tag("v1")
    shown.lake.erase([shown.recording], "a person in it", with_descendants=True)
    gone = answer(site, f"/key/thumbnail/{shown.recording}?at=v1")
    assert gone.status == 404
    assert "erased from all versions" in gone.content.decode()
    assert answer(site, f"/key/frames/{shown.recording}/0?at=v1").status == 404
    assert "not in the lake any more" in text(shown, f"artifact/{shown.recording}?at=v1")
    assert "no data" in text(shown, "?at=v1")


def test_meshes_are_drawn_and_move(shown: Shown) -> None:
    drawn = pictures(answer(shown.site, f"/key/frames/{shown.meshes}/0"))
    images = [np.asarray(Image.open(io.BytesIO(one)), float) for one in drawn]
    assert len(images) == 3
    assert all((image < 240).sum() > 1000 for image in images)  # cloth on a light ground
    assert np.abs(images[0] - images[2]).max() > 50
    assert answer(shown.site, f"/key/thumbnail/{shown.meshes}").status == 200
    assert json.loads(answer(shown.site, f"/key/series/{shown.meshes}").content)["wind"] is None


def test_the_wind_beside_a_film_is_that_of_its_truth_window_on_the_clock_of_its_frames(
    shown: Shown,
) -> None:
    found = json.loads(answer(shown.site, f"/key/series/{shown.recording}").content)
    assert found["frames"]["count"] == 150
    assert found["frames"]["time"][-1] == pytest.approx(149 * 0.04)
    time, speed = np.array(found["wind"]["time"]), np.array(found["wind"]["speed"])
    # Sample k was read 60 − k seconds before the first frame; a mean of a second stands at the
    # middle of it.
    expected = shown.wind[np.round(time + 60 + 0.5).astype(int)]
    assert np.abs(speed - expected).max() < 0.011
    assert time.min() >= -60.5
    assert time.max() <= 149 * 0.04
    of_clip = json.loads(answer(shown.site, f"/key/series/{shown.clip}").content)
    assert of_clip["frames"]["count"] == 30
    assert max(of_clip["wind"]["time"]) <= 29 * 0.04


def test_evidence_is_the_search_that_the_record_keeps(shown: Shown) -> None:
    found = json.loads(answer(shown.site, f"/key/evidence/{shown.recording}").content)
    assert found == {name: CURVE[name] for name in ("offset", "score", "evidence", "chance_score")}


def test_sql_answers_with_links_and_its_errors_keep_what_was_written(shown: Shown) -> None:
    asked = quote("select artifact, wind from catalog where kind = 'clip'")
    page = text(shown, f"query?sql={asked}")
    assert f'<a href="/key/artifact/{shown.clip}">{shown.clip[:12]}</a>' in page
    assert "<td>4.5</td>" in page
    wrong = text(shown, "query?sql=" + quote("select wnd from catalog"), status=400)
    assert "did you mean &#39;wind&#39;" in wrong
    assert "select wnd from catalog</textarea>" in wrong
    outside = text(shown, "query?sql=" + quote("select * from read_csv('/etc/passwd')"), status=400)
    assert "reads its catalog and nothing else" in outside
    assert "at most 10,000" in text(shown, "query?sql=" + "x" * 10_001, status=400)
    many = text(shown, "query?sql=" + quote("select range from range(1000)"))
    assert "200 of 1,000 rows" in many


def test_what_another_process_commits_is_shown_at_the_next_request(shown: Shown) -> None:
    site = shown.site
    assert len(cards(answer(site, "/key/").content.decode())) == 3
    with Lake.open(shown.lake.path).transaction("meanwhile") as tx:
        tx.add(_number())
    assert len(cards(answer(site, "/key/").content.decode())) == 4


def _number():
    from flagdata.lake import Artifact

    return Artifact(kind=Kind.MEASUREMENT, name="wind of the pier")
