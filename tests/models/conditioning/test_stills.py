"""What a film shows all the time, of values by hand."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from flagdata.errors import CorruptError
from models.conditioning import MaskNetwork, Stills, halve_picture, inputs_of, mask_network


def test_the_usual_value_is_what_a_place_returns_to() -> None:
    """A place that is bare for a quarter of the time, between values that never return."""
    passing = np.linspace(0, 90, 30)
    values = np.concatenate([passing, np.full(10, 200.0)])
    order = np.random.default_rng(0).permutation(40)
    stills = Stills.of(values[order][:, None, None])
    assert stills.usual.item() == 200
    assert stills.least.item() == pytest.approx(np.quantile(values, 0.03), abs=1)
    assert stills.greatest.item() == 200


def test_halved_averages() -> None:
    picture = np.array([[0, 2, 10, 10], [4, 6, 10, 10]], np.uint8)
    assert halve_picture(picture).tolist() == [[3.0, 10.0]]


def test_the_network_takes_any_size_and_gives_three_maps_of_it() -> None:
    assert MaskNetwork().eval()(torch.zeros(2, 4, 50, 37)).shape == (2, 3, 50, 37)


def test_gain_and_offset_of_the_light_change_no_input() -> None:
    """Up to what the deviation of a plain picture is held above."""
    rng = np.random.default_rng(1)
    pictures = rng.uniform(40, 120, (12, 8, 8))
    brighter = 1.5 * pictures + 30
    one = inputs_of(pictures, Stills.of(pictures))
    other = inputs_of(brighter, Stills.of(brighter))
    assert one.shape == (12, 4, 8, 8)
    assert float((other / one).median()) == pytest.approx(1.0, abs=0.15)


def test_black_bars_count_for_nothing() -> None:
    """The picture between them is as it is without them; they are 0."""
    pictures = np.random.default_rng(2).uniform(40, 120, (12, 8, 8))
    padded = np.pad(pictures, ((0, 0), (3, 3), (0, 0)))
    inputs = inputs_of(padded, Stills.of(padded))
    torch.testing.assert_close(inputs[:, :, 3:-3], inputs_of(pictures, Stills.of(pictures)))
    assert not inputs[:, :, :3].any()


def test_weights_that_do_not_fit_are_refused(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    from flagdata.core.files.checksums import write_sums
    from models.trained.model_folder import WEIGHTS, write_card, write_tensors

    write_card(tmp_path, {"name": "other"})
    write_tensors(tmp_path / WEIGHTS, {"weight": torch.zeros(3)})
    write_sums(tmp_path)
    monkeypatch.setattr(mask_network, "FOLDER", tmp_path)
    mask_network.load_shipped_mask.cache_clear()
    with pytest.raises(CorruptError, match="do not fit this code"):
        mask_network.load_shipped_mask()
    mask_network.load_shipped_mask.cache_clear()
