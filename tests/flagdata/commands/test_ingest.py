"""`flagdata ingest` as people and programs use it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flagdata.commands.ingest_options import frame_rate
from flagdata.errors import UsageError
from flagdata.lake import Lake
from tests.flagdata.conftest import small_files
from tests.program import Run, invoke


@pytest.fixture
def run(lake: Lake) -> Run:
    return lambda *arguments: invoke("ingest", *arguments, "--lake", lake.path)


def test_kind_is_inferred_from_content_not_name(
    run, lake: Lake, video: Path, wind_log: Path, tmp_path: Path
) -> None:
    (tmp_path / "a.csv").write_bytes(video.read_bytes())
    (tmp_path / "b.mp4").write_bytes(wind_log.read_bytes())
    code, out, _ = run(tmp_path / "a.csv", tmp_path / "b.mp4", "--json")
    assert code == 0
    found = json.loads(out)
    assert found["schema"] == "flagdata.ingest/1"
    assert [(r["kind"], r["created"]) for r in found["results"]] == [
        ("camera", True),
        ("wind", True),
    ]
    assert lake.rows().num_rows == 2


def test_the_report_for_people_says_format_time_rate_error_and_findings(
    run, video: Path, wind_log: Path
) -> None:
    code, out, _ = run(video, wind_log, "--session", "field-1")
    assert code == 0
    for expected in (
        "h264",
        "2026-05-01T10:00:00Z",
        "50 at 25 Hz",
        "worst stamp error 0.000 ms",
        "container 50 Hz",
        "letterboxed",
        "missing-values",
        "line 32",
        "120, median rate 1 Hz",
        "wind_speed [m/s]",
    ):
        assert expected in out, expected


def test_the_second_time_says_already_in_the_lake_and_exits_0(run, lake: Lake, video: Path) -> None:
    first = json.loads(run(video, "--json")[1])["results"][0]["artifact"]
    code, out, _ = run(video)
    assert code == 0
    assert out.startswith(f"already in the lake: {first}")
    assert lake.rows().num_rows == 1


def test_sniff_says_what_and_why_and_touches_no_lake(
    run, lake: Lake, video: Path, wind_log: Path
) -> None:
    code, out, _ = run("--sniff", video, wind_log)
    assert code == 0
    assert "camera: video" in out
    assert "100 frames at 50 Hz" in out
    assert "wind_speed (m/s)" in out
    assert "because" in out
    code, out, _ = run("--sniff", video, "--json")
    assert code == 0
    assert json.loads(out)["sources"][0]["camera"]["frames"] == 100
    assert lake.rows().num_rows == 0


def test_sniff_says_what_to_do_with_sentences_of_which_none_is_wind(run, tmp_path: Path) -> None:
    log = tmp_path / "boat.nmea"
    log.write_text("$IIMTW,16.8,C\n$IIDPT,14.8,0.4,100.0\n$IIMTW,16.9,C\n")
    _, out, _ = run("--sniff", log)
    assert "to do: its first 3 lines hold no sentence of wind" in out


def test_sniff_goes_on_after_a_source_it_cannot_read_and_says_what_is_missing(
    run, video: Path, wind_log: Path, tmp_path: Path
) -> None:
    (tmp_path / "frames").mkdir()
    for k in range(3):
        Image.fromarray(np.full((48, 64), 60 * k, dtype=np.uint8)).save(
            tmp_path / "frames" / f"{k}.png"
        )
    code, out, err = run("--sniff", tmp_path / "frames", tmp_path / "nothing", video)
    assert code == 1
    assert "image sequence" in out
    assert "no time stamps" in out
    assert "100 frames" in out
    assert "1 of 3 sources failed" in err
    code, _, err = run("--sniff", wind_log, "--crop", "auto")
    assert code == 2
    assert "--crop means nothing for an anemometer log" in err


def test_a_folder_of_pictures_is_one_camera_whatever_hidden_files_lie_in_it(
    run, lake: Lake, tmp_path: Path
) -> None:
    folder = tmp_path / "frames"
    folder.mkdir()
    for k in range(10):
        Image.fromarray(np.full((48, 64), 20 * k, dtype=np.uint8)).save(folder / f"{k:02d}.png")
    given = (folder, "--sequence-fps", 25, "--start", "2026-05-01T10:00:00Z")
    assert run(*given)[0] == 0
    (folder / ".DS_Store").write_bytes(b"x")
    assert run(*given)[1].startswith("already in the lake")
    (folder / "10.png").write_bytes((folder / "09.png").read_bytes())
    assert run(*given)[0] == 0
    assert sorted(row["frame_count"] for row in lake.rows().to_pylist()) == [10, 11]


def test_a_failing_source_stops_neither_the_others_nor_goes_unnamed(
    run, lake: Lake, video: Path, wind_log: Path, tmp_path: Path
) -> None:
    bad = tmp_path / "bad.mp4"
    bad.write_bytes(b"\0\0\0\x18ftypmp42" + b"\0" * 200)
    code, out, err = run(video, bad, wind_log)
    assert code == 1
    assert "bad.mp4" in err
    assert "1 of 3 sources failed" in err
    assert "camera field" in out
    assert lake.rows().num_rows == 2
    code, out, _ = run(video, bad, "--json")
    found = json.loads(out)
    assert code == 1
    assert [f["source"] for f in found["failures"]] == [str(bad)]
    assert [r["created"] for r in found["results"]] == [False]


def test_a_single_failure_has_its_own_exit_code_and_one_document(run, tmp_path: Path) -> None:
    code, out, err = run(tmp_path / "nothing.mp4", "--json")
    assert code == 1
    assert json.loads(out)["schema"] == "flagdata.error/1"
    assert "fix:" in err


def test_a_disk_that_refuses_the_record_is_one_clear_error_and_the_lake_is_unchanged(
    run, lake: Lake, video: Path
) -> None:
    with small_files():
        code, out, err = run(video, "--json")
    assert code == 1
    assert "ulimit -f" in json.loads(out)["fix"]
    assert "writing a record failed: File too large" in err
    assert "Traceback" not in err
    assert lake.rows().num_rows == 0
    assert not [p for p in lake.path.rglob("*.mcap") if p.is_file()]


MISUSED = [
    (["{log}", "--crop", "auto"], "--crop means nothing for an anemometer log"),
    (["{log}", "--true-fps", "1000"], "--true-fps means nothing"),
    (["{log}", "--archive", "h264"], "--archive means nothing"),
    (["{log}", "--start", "2026-05-01T10:00:00Z"], "--start is not used"),
    (["{video}", "--date-order", "dmy"], "--date-order means nothing for a camera file"),
    (["{video}", "--azimuth", "12"], "--azimuth means nothing"),
    (["{video}", "{log}", "--unit", "mm"], "'mm' is no unit of speed"),
    (["{video}", "--sensor", "generic-csv"], "--sensor means nothing for a camera file"),
    (
        ["{video}", "--start", "2026-05-01T10:00:00Z", "--zone", "UTC"],
        "--zone means nothing for a camera file wh",
    ),
    (["{video}", "--start", "2026-02-30T10:00:00Z"], "no day or time of the calendar"),
    (["{video}", "--start", "x"], "not an ISO 8601 time"),
    (["{video}", "--zone", "+99:00"], "beyond"),
    (["{log}", "--zone", "Qwxzy"], "give a name such as Europe/Amsterdam"),
    (["{video}", "{video}", "--start", "2026-05-01T10:00:00Z"], "--start with 2 sources"),
    (["{video}", "{log}", "--name", "a"], "--name with 2 sources"),
    (["{video}", "--crop-picture", "{video}.png"], "--crop-picture needs --crop auto"),
    (["{video}", "--crop", "1,2,3"], "not a crop"),
    (["{video}", "--rate", "fast"], "not a number"),
    (
        ["{video}", "--exposure", "5"],
        "an exposure of 5 s is longer than the 0.02 s from frame to frame",
    ),
    (["{video}", "--exposure", "0.0021", "--true-fps", "500"], "longer than the 0.002 s"),
    (["{video}", "--as", "vidoe"], "unknown format"),
    (["{log}", "--sensor", "generic-cvs"], "did you mean 'generic-csv'"),
    (["{log}", "--date", "1/5/2026"], "not a date"),
    (["{video}", "--zone", "Europe/Amsterdm"], "did you mean 'Europe/Amsterdam'"),
    (["{video}", "--sniff", "--session", "a"], "--session means nothing to --sniff"),
]


def test_options_that_do_not_apply_are_usage_errors_and_change_nothing(
    run: Run, lake: Lake, video: Path, wind_log: Path
) -> None:
    offenders = []
    for arguments, said in MISUSED:
        ended = run(*(a.format(video=video, log=wind_log) for a in arguments))
        if ended.code != 2 or said not in ended.err:
            offenders.append((arguments, ended))
    assert offenders == []
    assert lake.rows().num_rows == 0


def test_a_branch_that_is_not_there_is_not_found_and_nothing_is_ingested(
    run, lake: Lake, video: Path
) -> None:
    code, _, err = run(video, "--branch", "nowhere")
    assert code == 1
    assert "branch or commit 'nowhere'" in err
    assert lake.rows().num_rows == 0


def test_a_start_without_a_zone_is_refused_and_the_zone_option_settles_it(
    run, lake: Lake, video: Path
) -> None:
    code, _, err = run(video, "--start", "2026-05-01T12:00:00")
    assert code == 2
    assert "no zone" in err
    code, _, _ = run(video, "--start", "2026-05-01T12:00:00", "--zone", "Europe/Amsterdam")
    assert code == 0
    assert (
        lake.rows().to_pylist()[0]["start"] == 1_777_629_600_000_000_000
    )  # 10:00 UTC, summer time


def test_a_film_whose_start_nobody_knows_is_ingested_with_that_stated(
    run, lake: Lake, video: Path
) -> None:
    code, out, _ = run(video, "--start", "unknown", "--json")
    assert code == 0
    assert "start-unknown" in json.loads(out)["results"][0]["quality"]


@pytest.mark.parametrize(
    ("kind", "own", "others"),
    [
        ("film", "Instant of the first frame", ("anemometer", "Wind:", "Meshes")),
        ("wind", "Readings per second of a log", ("Camera:", "Meshes", "frames per second")),
        ("meshes", "Frames per second of a source", ("Camera:", "Wind:")),
    ],
)
def test_the_help_of_a_kind_speaks_of_that_kind_alone(
    run: Run,
    kind: str,
    own: str,
    others: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)  # where no file is named like a kind
    said = " ".join(run(kind, "--help").out.split())
    assert own in said
    assert [word for word in others if word in said] == []


def test_each_option_goes_to_the_sources_of_its_kind(
    run, lake: Lake, video: Path, wind_log: Path, tmp_path: Path
) -> None:
    log = tmp_path / "mast.csv"
    log.write_text(wind_log.read_text().replace(" (m/s)", "").replace(" (deg)", ""))
    code, _, err = run(
        video,
        log,
        "--sensor",
        "generic-csv",
        "--zero-offset",
        "report",
        "--zone",
        "Europe/Amsterdam",
        "--start",
        "2026-05-01T10:00:01Z",
        "--exposure",
        "0.01",
        "--archive",
        "h264",
    )
    assert code == 0, err
    recipes = {row["kind"]: json.loads(row["recipe"]) for row in lake.rows().to_pylist()}
    assert recipes["wind"]["wind"]["zero_offset"] == "report"
    assert recipes["wind"]["wind"]["recipe"] == "generic-csv"
    assert recipes["wind"]["wind"]["zone"] == "Europe/Amsterdam"
    assert recipes["camera"]["camera"]["exposure"] == 0.01
    assert recipes["camera"]["camera"]["zone"] is None  # its start has a zone of its own
    assert recipes["camera"]["stored"]["coding"] == "h264"


def test_an_unknown_zone_is_answered_in_a_line(run, video: Path) -> None:
    code, _, err = run(video, "--zone", "Qwxzy")
    assert code == 2
    assert len(err) < 300


def test_crop_auto_writes_the_picture_that_was_asked_for(run, video: Path, tmp_path: Path) -> None:
    code, out, _ = run("--sniff", video, "--crop", "auto", "--crop-picture", tmp_path / "seen.png")
    assert code == 0
    assert "of the motion" in out
    code, _, _ = run(video, "--crop", "auto", "--crop-picture", tmp_path / "crop.png")
    assert code == 0
    assert (tmp_path / "crop.png").read_bytes() == (tmp_path / "seen.png").read_bytes()


def test_a_crop_picture_that_cannot_be_written_leaves_the_lake_unchanged(
    run, lake: Lake, video: Path, tmp_path: Path
) -> None:
    picture = tmp_path / "nowhere" / "crop.png"
    code, _, err = run(video, "--crop", "auto", "--crop-picture", picture)
    assert code == 1
    assert "no such folder" in err
    code, _, err = run(video, "--crop", "auto", "--crop-picture", video)
    assert code == 1
    assert "exists" in err
    assert lake.rows().num_rows == 0
    picture.parent.mkdir()
    assert run(video, "--crop", "auto", "--crop-picture", picture)[0] == 0
    again = tmp_path / "again.png"
    assert run(video, "--crop", "auto", "--crop-picture", again)[1].startswith(
        "already in the lake"
    )
    assert again.read_bytes() == picture.read_bytes()


def test_no_crop_picture_is_left_by_an_ingest_that_failed(
    run, lake: Lake, video: Path, tmp_path: Path
) -> None:
    picture = tmp_path / "crop.png"
    with small_files():
        code, _, err = run(video, "--crop", "auto", "--crop-picture", picture)
    assert code == 1
    assert "File too large" in err
    assert not picture.exists()
    assert lake.rows().num_rows == 0


def test_an_exposure_up_to_the_true_step_from_frame_to_frame_shifts_stamps_by_its_half(
    run, lake: Lake, video: Path
) -> None:
    # 50 Hz in the container: 0.02 s; run at 500 Hz: 0.002 s.
    assert run(video, "--exposure", "0.02")[0] == 0
    assert lake.rows().to_pylist()[0]["start"] == 1_777_629_600_000_000_000 + 10_000_000
    assert run(video, "--exposure", "0.002", "--true-fps", "500")[0] == 0


def test_artifacts_go_to_the_branch_that_was_named(run, lake: Lake, wind_log: Path) -> None:
    lake.branch("trial")
    code, _, _ = run(wind_log, "--branch", "trial")
    assert code == 0
    assert lake.rows().num_rows == 0
    assert lake.rows(at="trial").num_rows == 1


def test_what_is_neither_camera_nor_wind_says_what_to_do(run, tmp_path: Path) -> None:
    (tmp_path / "flag.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "letter.txt").write_text("Dear diary,\nit blew hard today.\n")
    for name in ("flag.obj", "letter.txt"):
        code, _, err = run(tmp_path / name)
        assert code == 1
        assert "no video, wind log, folder of meshes or table of markers" in err
        assert "fix:" in err


def test_a_rate_is_hertz_or_the_time_between_two() -> None:
    cases = [
        ("20", 20.0),
        ("20Hz", 20.0),
        ("12.5 hz", 12.5),
        ("40ms", 25.0),
        ("10min", 1 / 600),
        ("1 h", 1 / 3600),
        (".5s", 2.0),
    ]
    assert [frame_rate(written) for written, _ in cases] == [rate for _, rate in cases]


@pytest.mark.parametrize("written", ["often", "0s", "10 minutes", "Hz", ""])
def test_what_is_no_rate_says_how_to_write_one(written: str) -> None:
    with pytest.raises(UsageError) as caught:
        frame_rate(written)
    assert "40ms" in str(caught.value.fix)
