"""The looks of `ten-looks`, and the arithmetic of its sheet."""

from __future__ import annotations

from tests.studies.validation.ten_looks import LOOKS, PRINTS, StudyAssets, summary


def test_each_look_of_the_study_is_a_picture_of_its_own_by_one_camera() -> None:
    assert len(LOOKS) == len({look.name for look in LOOKS}) == 10
    zetas = [look.zeta() for look in LOOKS]
    pictures = {
        (zeta.texture, zeta.background): StudyAssets().texture(zeta.texture) for zeta in zetas
    }
    assert len(pictures) == len(LOOKS)
    for name in PRINTS:
        assert StudyAssets().texture(f"study/{name}").shape == (384, 576, 3)
    camera = (
        "camera_radius",
        "camera_angle",
        "camera_height",
        "view_angle",
        "exposure_time",
        "width",
        "height",
    )
    assert len({tuple(getattr(zeta, name) for name in camera) for zeta in zetas}) == 1


def test_the_spread_is_of_the_films_that_are_answered() -> None:
    def said(value: float, *, refused: bool = False) -> dict[str, object]:
        return {
            "refused": refused,
            "reasons": [],
            "wind": {"value": value, "low": value - 1, "high": value + 1},
        }

    rows = [
        {"wind": 5.0, "open": said(4.5), "stated": said(5.0, refused=True)},
        {"wind": 5.0, "open": said(6.25), "stated": said(9.0, refused=True)},
        {
            "wind": 5.0,
            "open": said(9.0, refused=True),
            "stated": {"refused": True, "reasons": ["still"]},
        },
    ]
    found = summary(rows)
    assert found["open"]["5"] == {
        "films": 3,
        "refused": 1,
        "lowest": 4.5,
        "highest": 6.25,
        "spread": 1.75,
        "mean": 5.375,
        "largest_error": 1.25,
        "contained": 1,
    }
    assert found["stated"]["5"]["refused"] == 3
    assert found["stated"]["5"]["spread"] is None
