"""The encoder's network: a plain residual 3 x 3 CNN with batch norm, and its preprocessing.

Dense 3 x 3 convolutions (He et al. 2016, without bottlenecks) run near a CPU's peak and gain from
bfloat16, where depthwise ones do neither: of the networks raced it learns most in a CPU second
(LOG.md). The picture is dimmed outside the mask, the mask is the fourth channel, and the last map
is pooled under the mask: mean and spread.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

MEAN = (0.485, 0.456, 0.406)  # of ImageNet, as every network of the hub has it
STD = (0.229, 0.224, 0.225)
DIM_OUTSIDE = 0.25  # contrast that is left outside the mask
AROUND = 0.1  # least weight of a cell of the last map outside the mask


@dataclass(frozen=True, slots=True)
class Shape:
    """Size of a network: blocks and channels of its stages, length of its embedding."""

    depths: tuple[int, ...] = (2, 2, 2, 2)
    widths: tuple[int, ...] = (32, 64, 128, 256)
    dimension: int = 128

    def as_dict(self) -> dict[str, object]:
        """Return the fields as JSON has them."""
        return asdict(self)


class Block(nn.Module):
    """Two 3 x 3 convolutions with batch norm beside a shortcut; `stride` halves the map."""

    def __init__(self, before: int, width: int, stride: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(before, width, 3, stride, 1, bias=False)
        self.first_norm = nn.BatchNorm2d(width)
        self.second = nn.Conv2d(width, width, 3, 1, 1, bias=False)
        self.second_norm = nn.BatchNorm2d(width)
        nn.init.zeros_(self.second_norm.weight)
        self.shortcut = nn.Sequential()
        if stride > 1:
            self.shortcut.append(nn.AvgPool2d(stride))
        if stride > 1 or before != width:
            self.shortcut.append(nn.Conv2d(before, width, 1, bias=False))
            self.shortcut.append(nn.BatchNorm2d(width))

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, B, H, W) to (N, C, H / stride, W / stride)."""
        inner = functional.relu(self.first_norm(self.first(x)), inplace=True)
        inner = self.second_norm(self.second(inner))
        return functional.relu(inner + self.shortcut(x), inplace=True)


def prepare(crops: Tensor) -> Tensor:
    """Turn (N, S, S, 4) uint8 RGB and mask into the network's (N, 4, S, S) float32."""
    planes = crops.permute(0, 3, 1, 2).float() / 255.0
    mask = (planes[:, 3:] > 0.5).float()
    mean = torch.tensor(MEAN, device=crops.device).view(1, 3, 1, 1)
    std = torch.tensor(STD, device=crops.device).view(1, 3, 1, 1)
    colour = (planes[:, :3] - mean) / std * (DIM_OUTSIDE + (1.0 - DIM_OUTSIDE) * mask)
    return torch.cat([colour, 2.0 * mask - 1.0], dim=1)


class Network(nn.Module):
    """Crops to embeddings; `features` is what the heads of training see besides."""

    def __init__(self, shape: Shape) -> None:
        super().__init__()
        last = shape.widths[0]
        self.stem = nn.Sequential(
            nn.Conv2d(4, last, 3, stride=2, padding=1, bias=False),
            nn.BatchNorm2d(last),
            nn.ReLU(),
            nn.Conv2d(last, last, 3, stride=2, padding=1, bias=False),
            nn.BatchNorm2d(last),
            nn.ReLU(),
        )
        blocks: list[nn.Module] = []
        for stage, (depth, width) in enumerate(zip(shape.depths, shape.widths, strict=True)):
            for number in range(depth):
                blocks.append(Block(last, width, 2 if stage and not number else 1))
                last = width
        self.stages = nn.Sequential(*blocks)
        self.norm = nn.BatchNorm1d(2 * last)
        self.project = nn.Linear(2 * last, shape.dimension)
        self.shape = shape
        self.stride = 4 * 2 ** (len(shape.depths) - 1)  # px of the crop per cell of the last map

    def features(self, planes: Tensor) -> Tensor:
        """Mean and spread of the last map under the mask: (N, 2 C) float32, normalised."""
        last = self.stages(self.stem(planes)).float()
        mask = functional.avg_pool2d(planes[:, 3:].float() * 0.5 + 0.5, self.stride) + AROUND
        weights = mask / mask.sum(dim=(2, 3), keepdim=True)
        mean = (last * weights).sum(dim=(2, 3))
        spread = ((last - mean[:, :, None, None]) ** 2 * weights).sum(dim=(2, 3))
        pooled: Tensor = self.norm(torch.cat([mean, torch.sqrt(spread + 1e-4)], dim=1))
        return pooled

    def forward(self, crops: Tensor) -> Tensor:
        """Embed (N, S, S, 4) uint8: (N, D) float32 of unit norm."""
        return functional.normalize(self.project(self.features(prepare(crops))), dim=1)
