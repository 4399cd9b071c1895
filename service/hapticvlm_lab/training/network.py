"""The encoder's network: a small ConvNeXt with batch norm, and its preprocessing, in one module.

ConvNeXt blocks (depthwise 7 x 7, then two pointwise layers; Liu et al. 2022) behind a convolution
stem, with batch norm in place of layer norm: it trains several times faster from nothing, and folds
into the depthwise convolution when exported (LOG.md). The picture is dimmed outside the
mask, the mask is the fourth channel, and the last map is averaged under the mask.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

MEAN = (0.485, 0.456, 0.406)  # of ImageNet, as every ConvNeXt of the hub has it
STD = (0.229, 0.224, 0.225)
DIM_OUTSIDE = 0.25  # contrast that is left outside the mask
AROUND = 0.1  # least weight of a cell of the last map outside the mask


@dataclass(frozen=True, slots=True)
class Shape:
    """Size of a network: blocks and channels of its stages, length of its embedding."""

    depths: tuple[int, ...] = (2, 2, 6, 2)
    widths: tuple[int, ...] = (32, 64, 128, 256)
    dimension: int = 128

    def as_dict(self) -> dict[str, object]:
        """Return the fields as JSON has them."""
        return asdict(self)


class Block(nn.Module):
    """Depthwise 7 x 7, batch norm, two pointwise layers with GELU between, residual."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.depthwise = nn.Conv2d(width, width, 7, padding=3, groups=width, bias=False)
        self.norm = nn.BatchNorm2d(width)
        self.expand = nn.Linear(width, 4 * width)
        self.contract = nn.Linear(4 * width, width)
        self.scale = nn.Parameter(torch.full((width,), 0.1))

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, C, H, W) to the same shape."""
        inner = self.norm(self.depthwise(x)).permute(0, 2, 3, 1)
        inner = self.contract(functional.gelu(self.expand(inner))) * self.scale
        summed: Tensor = x + inner.permute(0, 3, 1, 2)
        return summed


def prepare(crops: Tensor) -> Tensor:
    """Turn (N, S, S, 4) uint8 RGB and mask into the network's (N, 4, S, S) float32."""
    planes = crops.permute(0, 3, 1, 2).float() / 255.0
    mask = (planes[:, 3:] > 0.0).float()
    mean = torch.tensor(MEAN, device=crops.device).view(1, 3, 1, 1)
    std = torch.tensor(STD, device=crops.device).view(1, 3, 1, 1)
    colour = (planes[:, :3] - mean) / std * (DIM_OUTSIDE + (1.0 - DIM_OUTSIDE) * mask)
    return torch.cat([colour, 2.0 * mask - 1.0], dim=1)


class Network(nn.Module):
    """Crops to embeddings; `features` is what the heads of training see besides."""

    def __init__(self, shape: Shape) -> None:
        super().__init__()
        first = shape.widths[0]
        self.stem = nn.Sequential(
            nn.Conv2d(4, first // 2, 3, stride=2, padding=1, bias=False),
            nn.BatchNorm2d(first // 2),
            nn.ReLU(),
            nn.Conv2d(first // 2, first, 3, stride=2, padding=1, bias=False),
            nn.BatchNorm2d(first),
        )
        stages: list[nn.Module] = []
        for number, (depth, width) in enumerate(zip(shape.depths, shape.widths, strict=True)):
            if number:
                before = shape.widths[number - 1]
                stages += [nn.BatchNorm2d(before), nn.Conv2d(before, width, 2, stride=2)]
            stages += [Block(width) for _ in range(depth)]
        self.stages = nn.Sequential(*stages)
        self.norm = nn.BatchNorm1d(2 * shape.widths[-1])
        self.project = nn.Linear(2 * shape.widths[-1], shape.dimension)
        self.shape = shape
        self.stride = 4 * 2 ** (len(shape.depths) - 1)  # px of the crop per cell of the last map

    def features(self, planes: Tensor) -> Tensor:
        """Mean and spread of the last map under the mask: (N, 2 C), normalised."""
        last = self.stages(self.stem(planes))
        mask = functional.avg_pool2d(planes[:, 3:] * 0.5 + 0.5, self.stride) + AROUND
        weights = mask / mask.sum(dim=(2, 3), keepdim=True)
        mean = (last * weights).sum(dim=(2, 3))
        spread = ((last - mean[:, :, None, None]) ** 2 * weights).sum(dim=(2, 3))
        pooled: Tensor = self.norm(torch.cat([mean, torch.sqrt(spread + 1e-4)], dim=1))
        return pooled

    def forward(self, crops: Tensor) -> Tensor:
        """Embed (N, S, S, 4) uint8: (N, D) float32 of unit norm."""
        return functional.normalize(self.project(self.features(prepare(crops))), dim=1)
