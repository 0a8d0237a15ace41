"""The spectral decomposition layer: where in the image, how strongly and how fast something moves.

Runia et al., Cloth in the Wind, CVPR 2020, section 5 and algorithm 1 of the supplement.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from flagdata.errors import InputError


def periodogram(signal: Tensor, *, rate: float) -> tuple[Tensor, Tensor]:
    """Computes power and frequency of real signals along dimension 2 (time) of a video volume.

    I(ω) = |F(jω)|² / N_t of the signal less its mean, under a Hann window w scaled so that Σw² =
    N_t: white noise then keeps its power, and a sinusoid of amplitude a at a bin's centre has its
    peak at a² N_t / 6.

    Args:
        signal: (batch, channel, time, height, width), floating.
        rate: frames per second [Hz].

    Returns:
        power (batch, channel, N_t // 2, height, width) without the bin at zero, and frequency (N_t
            // 2,) [Hz].

    Raises:
        InputError: fewer than four frames, or not floating.
    """
    if signal.ndim != 5 or not signal.is_floating_point():
        raise InputError(
            f"the volume has the shape {tuple(signal.shape)} and type {signal.dtype}",
            fix="give floating (batch, channel, time, height, width)",
        )
    frames = signal.shape[2]
    if frames < 4:
        raise InputError(f"{frames} frames have no spectrum", fix="give at least 4")
    window = torch.hann_window(frames, periodic=True, dtype=signal.dtype, device=signal.device)
    window = window * (frames / window.square().sum()).sqrt()
    centred = signal - signal.mean(dim=2, keepdim=True)
    spectrum = torch.fft.rfft(centred * window[:, None, None], dim=2)[:, :, 1:]
    frequency = torch.fft.rfftfreq(frames, 1 / rate, dtype=signal.dtype, device=signal.device)[1:]
    return spectrum.abs().square() / frames, frequency


class SpectralDecomposition(nn.Module):
    """Maps (batch, C, time, H, W) to (batch, 2kC, H, W): the k strongest powers and their
    frequencies at each pixel.

    The channels are ordered power 1 … k of channel 1, …, then the frequencies likewise. Frequencies
    are in Hz; the gradient flows through the powers alone, since an index has none. The mean is
    taken out first and the bin at zero
    is not a candidate: a clip's brightness is not motion.

    Args:
        rate: frames per second [Hz].
        peaks: k; 1 in the paper.
    """

    def __init__(self, *, rate: float, peaks: int = 1) -> None:
        super().__init__()
        if rate <= 0 or peaks < 1:
            raise InputError(
                f"the rate is {rate} Hz, with {peaks} peaks",
                fix="give a rate above 0 and at least one peak",
            )
        self.rate = rate
        self.peaks = peaks

    def forward(self, clip: Tensor) -> Tensor:
        power, frequency = periodogram(clip, rate=self.rate)
        if self.peaks > power.shape[2]:
            raise InputError(
                f"{self.peaks} peaks cannot be taken of {power.shape[2]} frequencies",
                fix="use more frames or fewer peaks",
            )
        strongest, index = power.topk(self.peaks, dim=2)
        return torch.cat([strongest.flatten(1, 2), frequency[index].flatten(1, 2)], dim=1)
