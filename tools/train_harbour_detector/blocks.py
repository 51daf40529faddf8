"""The pieces YOLOX-Nano is put together from.

A convolution carries its batch normalisation and SiLU. Nano splits every 3x3 convolution in two:
one filter for each channel, then a mix of channels (depthwise separable, as in MobileNet); that is
what makes it small. Cross-stage-partial layers (CSPNet) send half of the channels past the rest.
"""

import torch
from torch import Tensor, nn

_BN_EPSILON, _BN_MOMENTUM = 1e-3, 0.03  # as the YOLOX paper's code base sets them


class ConvBlock(nn.Module):
    """Convolution, batch normalisation, SiLU; padded so that stride 1 keeps the size."""

    def __init__(
        self, inputs: int, outputs: int, kernel: int, stride: int = 1, groups: int = 1
    ) -> None:
        super().__init__()
        self.conv = nn.Conv2d(
            inputs, outputs, kernel, stride, (kernel - 1) // 2, groups=groups, bias=False
        )
        self.norm = nn.BatchNorm2d(outputs, eps=_BN_EPSILON, momentum=_BN_MOMENTUM)
        self.act = nn.SiLU(inplace=True)

    def forward(self, x: Tensor) -> Tensor:
        """Return (n, outputs, h / stride, w / stride) for x (n, inputs, h, w)."""
        return self.act(self.norm(self.conv(x)))


class SeparableConv(nn.Sequential):
    """A 3x3 filter for each channel, then a 1x1 mix of channels."""

    def __init__(self, inputs: int, outputs: int, stride: int = 1) -> None:
        super().__init__(
            ConvBlock(inputs, inputs, 3, stride, groups=inputs), ConvBlock(inputs, outputs, 1)
        )


class Focus(nn.Module):
    """Fold each 2x2 square of pixels into channels, then convolve: half the size, none lost."""

    def __init__(self, outputs: int) -> None:
        super().__init__()
        self.conv = ConvBlock(12, outputs, 3)

    def forward(self, x: Tensor) -> Tensor:
        """Return (n, outputs, h / 2, w / 2) for an image x (n, 3, h, w)."""
        folded = [x[..., ::2, ::2], x[..., 1::2, ::2], x[..., ::2, 1::2], x[..., 1::2, 1::2]]
        return self.conv(torch.cat(folded, dim=1))


class Bottleneck(nn.Module):
    """1x1, then separable 3x3, and the input added where `shortcut` is set."""

    def __init__(self, channels: int, *, shortcut: bool) -> None:
        super().__init__()
        self.steps = nn.Sequential(
            ConvBlock(channels, channels, 1), SeparableConv(channels, channels)
        )
        self.shortcut = shortcut

    def forward(self, x: Tensor) -> Tensor:
        """Keep the shape of x."""
        return x + self.steps(x) if self.shortcut else self.steps(x)


class CspLayer(nn.Module):
    """Half of the channels through `count` bottlenecks, half past them, mixed at the end."""

    def __init__(self, inputs: int, outputs: int, count: int, *, shortcut: bool) -> None:
        super().__init__()
        hidden = outputs // 2
        self.through = ConvBlock(inputs, hidden, 1)
        self.past = ConvBlock(inputs, hidden, 1)
        self.steps = nn.Sequential(*(Bottleneck(hidden, shortcut=shortcut) for _ in range(count)))
        self.mix = ConvBlock(2 * hidden, outputs, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Return (n, outputs, h, w) for x (n, inputs, h, w)."""
        return self.mix(torch.cat([self.steps(self.through(x)), self.past(x)], dim=1))


class PyramidPooling(nn.Module):
    """Largest values within 5, 9 and 13 cells beside the cell itself (SPP)."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        hidden = channels // 2
        self.narrow = ConvBlock(channels, hidden, 1)
        self.pools = nn.ModuleList(nn.MaxPool2d(size, 1, size // 2) for size in (5, 9, 13))
        self.mix = ConvBlock(4 * hidden, channels, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Keep the shape of x."""
        x = self.narrow(x)
        return self.mix(torch.cat([x, *(pool(x) for pool in self.pools)], dim=1))
