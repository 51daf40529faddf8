"""YOLOX-Nano: CSPDarknet at depth 0.33 and width 0.25, PAFPN, decoupled head, depthwise.

Written from the description in "YOLOX: Exceeding YOLO Series in 2021" (Ge et al.). In training
the network tells one class, vessel; `CocoShaped` puts it where the shared export has it, class 8
of COCO's 80, and says "no" to the other 79.
"""

from math import log

import torch
from torch import Tensor, nn

from tools.train_harbour_detector.blocks import (
    ConvBlock,
    CspLayer,
    Focus,
    PyramidPooling,
    SeparableConv,
)

STRIDES = (8, 16, 32)
COCO_CLASSES, COCO_BOAT = 80, 8
_WIDTHS = (64, 128, 256)  # channels at the three strides: a quarter of the full network's
_STEM = 16
_HEAD = 64
_PRIOR = 0.01  # of a cell to see something, before anything is learnt


class Backbone(nn.Module):
    """CSPDarknet: features at strides 8, 16 and 32."""

    def __init__(self) -> None:
        super().__init__()
        c3, c4, c5 = _WIDTHS
        self.stem = Focus(_STEM)
        self.dark2 = nn.Sequential(SeparableConv(_STEM, 32, 2), CspLayer(32, 32, 1, shortcut=True))
        self.dark3 = nn.Sequential(SeparableConv(32, c3, 2), CspLayer(c3, c3, 3, shortcut=True))
        self.dark4 = nn.Sequential(SeparableConv(c3, c4, 2), CspLayer(c4, c4, 3, shortcut=True))
        self.dark5 = nn.Sequential(
            SeparableConv(c4, c5, 2), PyramidPooling(c5), CspLayer(c5, c5, 1, shortcut=False)
        )

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return features (n, 64 | 128 | 256, h / s, w / s) for images x (n, 3, h, w)."""
        fine = self.dark3(self.dark2(self.stem(x)))
        middle = self.dark4(fine)
        return fine, middle, self.dark5(middle)


class Neck(nn.Module):
    """PAFPN: what the coarse grids know goes to the fine ones, and back again."""

    def __init__(self) -> None:
        super().__init__()
        c3, c4, c5 = _WIDTHS
        self.up = nn.Upsample(scale_factor=2, mode="nearest")
        self.narrow5, self.narrow4 = ConvBlock(c5, c4, 1), ConvBlock(c4, c3, 1)
        self.down4 = CspLayer(2 * c4, c4, 1, shortcut=False)
        self.down3 = CspLayer(2 * c3, c3, 1, shortcut=False)
        self.shrink3, self.shrink4 = SeparableConv(c3, c3, 2), SeparableConv(c4, c4, 2)
        self.up4 = CspLayer(2 * c3, c4, 1, shortcut=False)
        self.up5 = CspLayer(2 * c4, c5, 1, shortcut=False)

    def forward(self, features: tuple[Tensor, Tensor, Tensor]) -> tuple[Tensor, Tensor, Tensor]:
        """Keep the shapes of the three features."""
        fine, middle, coarse = features
        coarse = self.narrow5(coarse)
        middle = self.narrow4(self.down4(torch.cat([self.up(coarse), middle], dim=1)))
        fine = self.down3(torch.cat([self.up(middle), fine], dim=1))
        middle = self.up4(torch.cat([self.shrink3(fine), middle], dim=1))
        return fine, middle, self.up5(torch.cat([self.shrink4(middle), coarse], dim=1))


class Head(nn.Module):
    """One level's decoupled head: class on one branch, box and objectness on the other."""

    def __init__(self, inputs: int) -> None:
        super().__init__()
        self.stem = ConvBlock(inputs, _HEAD, 1)
        self.class_steps = nn.Sequential(*(SeparableConv(_HEAD, _HEAD) for _ in range(2)))
        self.box_steps = nn.Sequential(*(SeparableConv(_HEAD, _HEAD) for _ in range(2)))
        self.box, self.objectness = nn.Conv2d(_HEAD, 4, 1), nn.Conv2d(_HEAD, 1, 1)
        self.classes = nn.Conv2d(_HEAD, 1, 1)
        for output in (self.objectness, self.classes):
            nn.init.constant_(output.bias, -log((1 - _PRIOR) / _PRIOR))

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return box (n, 4, h, w), and logits of objectness and class."""
        x = self.stem(x)
        around = self.box_steps(x)
        return self.box(around), self.objectness(around), self.classes(self.class_steps(x))


class YoloxNano(nn.Module):
    """Images (n, 3, h, w), BGR 0 to 255, to rows (n, cells, 6) of logits.

    A row is offset x y and logarithmic size w h, in strides; then objectness and class as logits.
    Sides must be multiples of 32. Cells run level by level (8, 16, 32), row by row.
    """

    def __init__(self) -> None:
        super().__init__()
        self.backbone, self.neck = Backbone(), Neck()
        self.heads = nn.ModuleList(Head(width) for width in _WIDTHS)

    def forward(self, x: Tensor) -> Tensor:
        """Return the raw rows."""
        levels = zip(self.heads, self.neck(self.backbone(x)), strict=True)
        answers = [torch.cat(head(feature), dim=1) for head, feature in levels]
        return torch.cat([a.flatten(2) for a in answers], dim=2).transpose(1, 2)


class CocoShaped(nn.Module):
    """The trained network as the shared export answers: (1, cells, 85), probabilities."""

    def __init__(self, network: YoloxNano) -> None:
        super().__init__()
        self.network = network

    def forward(self, images: Tensor) -> Tensor:
        """Return offset x y, log size w h, objectness, and 80 class probabilities."""
        rows = self.network(images)
        none = torch.zeros_like(rows[..., :1])
        before, after = COCO_BOAT, COCO_CLASSES - COCO_BOAT - 1
        sure = rows[..., 4:].sigmoid()
        classes = [none.expand(-1, -1, before), sure[..., 1:], none.expand(-1, -1, after)]
        return torch.cat([rows[..., :4], sure[..., :1], *classes], dim=2)


def grid(width_px: int, height_px: int) -> Tensor:
    """Column, row and stride of every cell, (cells, 3), in the order of the rows."""
    levels = []
    for stride in STRIDES:
        row, column = torch.meshgrid(
            torch.arange(height_px // stride), torch.arange(width_px // stride), indexing="ij"
        )
        levels.append(torch.stack([column, row, torch.full_like(row, stride)], dim=-1).view(-1, 3))
    return torch.cat(levels).float()
