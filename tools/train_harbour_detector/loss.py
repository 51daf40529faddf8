"""What the network is told about its answers: SimOTA, then IoU, cross-entropy and L1.

SimOTA (YOLOX paper, section 2.1, after OTA of Ge et al.) lets each vessel choose the cells that
answer for it: those with the lowest cost of class and box, near its middle, as many as its ten
best overlaps sum up to. A cell wanted by two goes to the cheaper. The chosen learn box and class;
every cell learns whether it was chosen, save those within a vessel that is to be ignored.
"""

import torch
import torch.nn.functional as nnf
from torch import Tensor

_NEAR_STRIDES = 2.5
_OVERLAPS = 10
_BOX_COST, _FAR_COST = 3.0, 1e5
_BOX_WEIGHT = 5.0


def decode(rows: Tensor, grid: Tensor) -> Tensor:
    """Return boxes (..., cells, 4), x1 y1 x2 y2 px, of rows (..., cells, 6) and grid (cells, 3)."""
    stride = grid[:, 2:]
    centre = (rows[..., :2] + grid[:, :2]) * stride
    half = rows[..., 2:4].clamp(max=8).exp() * stride / 2
    return torch.cat([centre - half, centre + half], dim=-1)


def pair_iou(a: Tensor, b: Tensor) -> Tensor:
    """Intersection over union of boxes a (..., 4) and b (..., 4), broadcast."""
    sides = torch.minimum(a[..., 2:], b[..., 2:]) - torch.maximum(a[..., :2], b[..., :2])
    common = sides.clamp(min=0).prod(dim=-1)
    areas = (a[..., 2:] - a[..., :2]).prod(dim=-1) + (b[..., 2:] - b[..., :2]).prod(dim=-1)
    return common / (areas - common + 1e-6)


@torch.no_grad()
def assign(rows: Tensor, boxes: Tensor, targets: Tensor, grid: Tensor) -> tuple[Tensor, Tensor]:
    """Choose cells for vessels by SimOTA.

    Args:
        rows: (cells, 6) of one image, as the network gives them.
        boxes: (cells, 4), the same decoded.
        targets: (n, 4), x1 y1 x2 y2 px, n at least 1.
        grid: (cells, 3).

    Returns:
        Indices of the chosen cells (m,), and the target of each (m,).

    """
    stride = grid[:, 2]
    at = (grid[:, :2] + 0.5) * stride[:, None]
    middle = (targets[:, None, :2] + targets[:, None, 2:]) / 2
    near = ((at - middle).abs() < _NEAR_STRIDES * stride[:, None]).all(dim=-1)
    within = ((at > targets[:, None, :2]) & (at < targets[:, None, 2:])).all(dim=-1)
    cells = (near | within).any(dim=0).nonzero().squeeze(1)
    near, within = near[:, cells], within[:, cells]
    iou = pair_iou(targets[:, None], boxes[cells])
    sure = (rows[cells, 4].sigmoid() * rows[cells, 5].sigmoid()).sqrt()
    class_cost = -sure.clamp(min=1e-8).log()
    cost = class_cost - _BOX_COST * (iou + 1e-8).log() + _FAR_COST * ~(near & within)
    best = iou.topk(min(_OVERLAPS, iou.shape[1]), dim=1).values
    chosen = torch.zeros_like(iou, dtype=torch.bool)
    for row, count in enumerate(best.sum(dim=1).int().clamp(min=1).tolist()):
        chosen[row, cost[row].topk(count, largest=False).indices] = True
    cheapest = cost.masked_fill(~chosen, float("inf")).argmin(dim=0)
    taken = chosen.any(dim=0)
    return cells[taken], cheapest[taken]


def loss_of(rows: Tensor, samples: list[Tensor], grid: Tensor) -> tuple[Tensor, dict[str, float]]:
    """Return the loss of a batch, and its parts for the log.

    Args:
        rows: (n, cells, 6).
        samples: n times (vessels, 5): x1 y1 x2 y2 px, 1 target or 0 to ignore.
        grid: (cells, 3).

    """
    boxes = decode(rows, grid)
    at = (grid[:, :2] + 0.5) * grid[:, 2:]
    seen = torch.zeros(rows.shape[:2])
    counts = torch.ones(rows.shape[:2])
    images, cells, wanted = [], [], []
    for image, sample in enumerate(samples):
        ignored, targets = sample[sample[:, 4] == 0, :4], sample[sample[:, 4] > 0, :4]
        hidden = (at > ignored[:, None, :2]) & (at < ignored[:, None, 2:])
        counts[image, hidden.all(dim=-1).any(dim=0)] = 0
        if len(targets):
            chosen, owner = assign(rows[image].detach(), boxes[image].detach(), targets, grid)
            seen[image, chosen], counts[image, chosen] = 1, 1
            images.append(torch.full_like(chosen, image))
            cells.append(chosen)
            wanted.append(targets[owner])
    number = max(1, sum(map(len, cells)))
    parts = {"objectness": _entropy(rows[..., 4], seen, counts) / number}
    if cells:
        where, truth = (torch.cat(images), torch.cat(cells)), torch.cat(wanted)
        iou = pair_iou(boxes[where], truth)
        parts["box"] = _BOX_WEIGHT * (1 - iou**2).sum() / number
        parts["class"] = _entropy(rows[..., 5][where], iou.detach(), torch.ones(())) / number
        parts["distance"] = _distance(rows[where], truth, grid[where[1]]) / number
    return sum(parts.values(), torch.zeros(())), {k: float(v.detach()) for k, v in parts.items()}


def _entropy(logits: Tensor, wanted: Tensor, weights: Tensor) -> Tensor:
    each = nnf.binary_cross_entropy_with_logits(logits, wanted, reduction="none")
    return (each * weights).sum()


def _distance(rows: Tensor, truth: Tensor, grid: Tensor) -> Tensor:
    """L1 between what the rows (m, 6) say and what they should have said for boxes (m, 4)."""
    stride = grid[:, 2:]
    offset = (truth[:, :2] + truth[:, 2:]) / 2 / stride - grid[:, :2]
    size = ((truth[:, 2:] - truth[:, :2]) / stride).log()
    return (rows[:, :4] - torch.cat([offset, size], dim=1)).abs().sum()
