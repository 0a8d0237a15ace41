"""Every network by its line in the table: the contract, published sizes, and that training can
reach all weights."""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator
from typing import Any

import pytest
import torch
from torch import nn

from flagdata.errors import InputError
from models.networks.baselines import Cardona, ResNetOfFrames, Yang, evenly_spaced
from models.networks.blocks import BasicBlock, ResNet18
from models.networks.network import INPUTS, Network
from models.networks.networks_by_name import NETWORKS
from models.networks.sdn import SpectralNetwork
from tests.refusals import unrefused

SMALL: dict[str, dict[str, Any]] = {
    "sdn": {"widths": (8, 8, 16), "dimension": 12},
    "resnet18": {"frames": 3, "width": 4},
    "cardona": {"frames": 4, "width": 4, "hidden": 8},
    "wave": {"widths": (6, 8, 8), "dimension": 5},
    "flow": {"widths": (6, 8, 8), "dimension": 5},
    "flow-3": {"widths": (6, 8, 8), "dimension": 5},
    "yang": {"frames": 4, "hidden": 8, "grid": 2, "features": 16},
}
"""Arguments that make each network of the table small enough for a test."""


@pytest.fixture(autouse=True)
def _seeded() -> Iterator[None]:
    with torch.random.fork_rng():
        torch.manual_seed(7)
        yield


def count(module: nn.Module) -> int:
    return sum(parameter.numel() for parameter in module.parameters())


def batch(network: Any, size: int = 3) -> torch.Tensor:
    if network.takes == "frames":
        return torch.randn(size, 1, 6, 64, 72)
    return torch.rand(size, network.channels, 24, 28)


def test_every_network_of_the_table_is_tested_here() -> None:
    assert set(SMALL) == set(NETWORKS)


@pytest.mark.parametrize("name", SMALL)
def test_a_network_keeps_the_contract(name: str) -> None:
    kind = NETWORKS[name]
    network = kind(**SMALL[name])
    assert isinstance(network, Network)
    assert isinstance(network, nn.Module)
    assert network.takes in INPUTS
    embedding = network(batch(network))
    assert embedding.shape == (3, network.dimension)
    assert embedding.dtype == torch.float32
    for parameter in inspect.signature(kind).parameters.values():
        assert parameter.kind is inspect.Parameter.KEYWORD_ONLY
        assert parameter.default is not inspect.Parameter.empty


@pytest.mark.parametrize("name", SMALL)
def test_every_weight_gets_a_gradient(name: str) -> None:
    network = NETWORKS[name](**SMALL[name])
    network(batch(network)).square().sum().backward()
    idle = [
        key
        for key, p in network.named_parameters()
        if p.grad is None or not bool(p.grad.abs().max() > 0)
    ]
    assert idle == []


@pytest.mark.parametrize("name", SMALL)
def test_in_evaluation_a_clip_does_not_depend_on_its_batch(name: str) -> None:
    """Tolerance: other batch sizes may add in another order, in float32."""
    network = NETWORKS[name](**SMALL[name]).eval()
    x = batch(network)
    torch.testing.assert_close(network(x)[1:2], network(x[1:2]), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("name", SMALL)
def test_equal_seeds_give_equal_networks(name: str) -> None:
    torch.manual_seed(3)
    first = NETWORKS[name](**SMALL[name])
    torch.manual_seed(3)
    second = NETWORKS[name](**SMALL[name])
    for a, b in zip(first.parameters(), second.parameters(), strict=True):
        assert torch.equal(a, b)


def test_recurrent_networks_say_so() -> None:
    assert {name: NETWORKS[name].recurrent for name in SMALL} == {
        "sdn": False,
        "resnet18": False,
        "cardona": True,
        "wave": False,
        "flow": False,
        "flow-3": False,
        "yang": True,
    }


def test_sizes_are_the_published_ones_or_as_stated() -> None:
    """11,689,512 is ResNet-18's published size, of which 513,000 are the classes'; the others,
    Runia et al. section 6.

    By hand, an LSTM layer of h units and d inputs has 4h(d + h + 2) parameters.
    """
    with torch.device("meta"):
        assert count(ResNet18(channels=3)) == 11_689_512 - 513_000
        gray = 2 * 64 * 49
        assert count(ResNetOfFrames()) == 11_689_512 - 513_000 - gray == 11_170_240
        memory = 4 * 1000 * (4608 + 1002) + 4 * 1000 * (1000 + 1002)
        assert count(Cardona()) == 11_170_240 + memory == 41_618_240
        assert round((count(Cardona()) + gray + 513_000) / 1e6, 1) == 42.1
        assert count(Yang()) == 44_666_688
        assert count(SpectralNetwork()) == 2_626_384
    stated = {
        ResNetOfFrames: 11_170_240,
        Cardona: 41_618_240,
        Yang: 44_666_688,
        SpectralNetwork: 2_626_384,
    }
    for kind, parameters in stated.items():
        assert f"{parameters:,} parameters" in str(kind.__doc__)


def test_the_spectral_network_takes_maps_of_both_sizes() -> None:
    cases = [112, 56]
    assert [SpectralNetwork()(torch.rand(2, 4, side, side)).shape for side in cases] == [
        (2, 512) for side in cases
    ]


@pytest.mark.parametrize("side", [112, 224])
@pytest.mark.parametrize("name", ["resnet18", "cardona", "yang"])
def test_the_baselines_take_frames_of_both_sizes(name: str, side: int) -> None:
    network = NETWORKS[name](**SMALL[name]).eval()
    with torch.no_grad():
        assert network(torch.randn(1, 1, 5, side, side)).shape == (1, network.dimension)


def test_maps_are_scaled_as_stated() -> None:
    network = SpectralNetwork(floor=0.01, nyquist=12.5)
    maps = torch.tensor([0.01, 0.0, 12.5, 2.5]).reshape(1, 4, 1, 1)
    torch.testing.assert_close(
        network.scaled(maps).flatten(), torch.tensor([math.log(2), 0.0, 1.0, 0.2])
    )


def test_a_block_that_adds_nothing_passes_its_input_on() -> None:
    block = BasicBlock(inputs=3, width=3, stride=1)
    nn.init.zeros_(block.residual[4].weight)
    x = torch.randn(2, 3, 5, 4)
    assert torch.equal(block(x), x.relu())


def test_initial_weights_have_the_variance_of_he() -> None:
    """N(0, 2/fan_out): the sample variance of m weights scatters by sqrt(2/m), of which five are
    allowed."""
    layer = next(
        m for m in ResNet18(width=32).modules() if isinstance(m, nn.Conv2d) and m.in_channels == 128
    )
    weight = layer.weight.detach()
    expected = 2 / (layer.out_channels * 9)
    assert weight.var().item() == pytest.approx(expected, rel=5 * (2 / weight.numel()) ** 0.5)


def test_frames_lie_in_the_middle_of_equal_parts() -> None:
    cases = [(30, 1, [15]), (30, 10, list(range(1, 30, 3))), (6, 6, list(range(6))), (5, 2, [1, 3])]
    assert [evenly_spaced(frames, count_).tolist() for frames, count_, _ in cases] == [
        expected for _, _, expected in cases
    ]


def test_averaged_frames_have_no_order_and_read_ones_have() -> None:
    """Temporal average pooling forgets the order of frames; an LSTM that is worth its name does
    not."""
    clip = torch.randn(1, 1, 4, 64, 64)
    pooled = ResNetOfFrames(frames=4, width=4).eval()
    torch.testing.assert_close(pooled(clip), pooled(clip.flip(2)), rtol=1e-4, atol=1e-5)
    read = Cardona(frames=4, width=4, hidden=8).eval()
    assert not torch.allclose(read(clip), read(clip.flip(2)), rtol=1e-2, atol=1e-4)


def test_a_single_frame_is_all_that_a_single_frame_network_sees() -> None:
    network = ResNetOfFrames(frames=1, width=4).eval()
    clip = torch.randn(1, 1, 5, 64, 64)
    other = clip.clone()
    other[:, :, [0, 1, 3, 4]] = 0.0
    assert torch.equal(network(clip), network(other))


def test_unfit_input_is_an_error_with_its_fix() -> None:
    with pytest.raises(InputError, match="from 1 to 6 frames"):
        ResNetOfFrames(frames=7, width=4)(torch.randn(1, 1, 6, 64, 64))
    with pytest.raises(InputError, match="at least 64×64"):
        Yang(**SMALL["yang"])(torch.randn(1, 1, 6, 32, 64))
    with pytest.raises(InputError, match=r"give \(batch, 4, height, width\)"):
        SpectralNetwork(**SMALL["sdn"])(torch.rand(1, 6, 24, 24))


def test_unfit_arguments_are_errors() -> None:
    cases = [
        ("sdn", {"channels": 3}),
        ("sdn", {"widths": (8, 8)}),
        ("sdn", {"floor": 0.0}),
        ("resnet18", {"frames": 0}),
        ("resnet18", {"width": 0}),
        ("cardona", {"hidden": 0}),
        ("yang", {"grid": 0}),
    ]
    assert not unrefused(lambda name, arguments: NETWORKS[name](**arguments), cases, InputError)
