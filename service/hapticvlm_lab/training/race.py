"""Race networks on one pool: `python -m hapticvlm_lab.training.race --pool P --out F`.

Each learns by the same recipe, rate and seed on one thread until its time is over, so what counts
is how much a second of CPU teaches. Stem, pooling and heads are the same; the blocks differ. Prints
a table; with --json one object. A network that is in the folder already goes on where it was cut.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from hapticvlm_lab.training.answers import Pool
from hapticvlm_lab.training.distil import CHECKPOINT, Plan, Run, left_out_scores, train
from hapticvlm_lab.training.network import Block, Network, Shape, prepare

LEGS = 6  # rows of the table a network
STEPS = 20  # between two looks at the clock
TIMED = 50


class Depthwise(nn.Module):
    """A residual block about one depthwise convolution of `side`, then two of 1 x 1.

    With side 7 and GELU after the first 1 x 1 it is ConvNeXt's (Liu et al. 2022), with batch norm.
    """

    def __init__(self, before: int, width: int, stride: int, side: int = 7) -> None:
        super().__init__()
        self.down = nn.Sequential()
        if stride > 1 or before != width:
            self.down.append(nn.Conv2d(before, width, stride, stride, bias=False))
            self.down.append(nn.BatchNorm2d(width))
        self.inner = nn.Sequential(
            nn.Conv2d(width, width, side, padding=side // 2, groups=width, bias=False),
            nn.BatchNorm2d(width),
            nn.Conv2d(width, 4 * width, 1),
            nn.GELU(),
            nn.Conv2d(4 * width, width, 1),
        )

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, B, H, W) to (N, C, H / stride, W / stride)."""
        x = self.down(x)
        return x + self.inner(x)  # type: ignore[no-any-return]


class Inverted(nn.Module):
    """MobileNetV2's inverted residual block (Sandler et al. 2018): wide inside, depthwise 3 x 3."""

    def __init__(self, before: int, width: int, stride: int) -> None:
        super().__init__()
        wide = 6 * before
        self.is_residual = stride == 1 and before == width
        self.inner = nn.Sequential(
            *(nn.Conv2d(before, wide, 1, bias=False), nn.BatchNorm2d(wide), nn.ReLU6()),
            nn.Conv2d(wide, wide, 3, stride, 1, groups=wide, bias=False),
            *(nn.BatchNorm2d(wide), nn.ReLU6()),
            *(nn.Conv2d(wide, width, 1, bias=False), nn.BatchNorm2d(width)),
        )

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, B, H, W) to (N, C, H / stride, W / stride)."""
        inner: Tensor = self.inner(x)
        return x + inner if self.is_residual else inner


NETWORKS: dict[str, tuple[Shape, Callable[[int, int, int], nn.Module]]] = {
    "plain residual 3 x 3": (Shape(), Block),
    "plain, wide and shallow": (Shape(depths=(1, 1, 1, 1), widths=(40, 80, 160, 320)), Block),
    "plain, narrow and deep": (Shape(depths=(3, 3, 4, 3), widths=(24, 48, 96, 192)), Block),
    "ConvNeXt, depthwise 7 x 7": (Shape(depths=(2, 2, 6, 2)), Depthwise),
    "MobileNetV2, inverted": (Shape(depths=(2, 3, 4, 3), widths=(24, 40, 80, 192)), Inverted),
}


def race(name: str, plan: Plan, pool: Pool, folder: Path, cpu_s: float) -> list[dict[str, Any]]:
    """Train one network for so many CPU seconds; return a row for each leg of it."""
    folder.mkdir(parents=True, exist_ok=True)
    checkpoint, written = folder / CHECKPOINT, folder / "rows.json"
    run = Run(plan, pool.names, NETWORKS[name][1])
    rows: list[dict[str, Any]] = []
    if written.exists():
        run.load(checkpoint)
        rows = json.loads(written.read_text(encoding="utf-8"))
    while len(rows) < LEGS:
        while run.progress.cpu_s < cpu_s * (len(rows) + 1) / LEGS:
            train(run, pool, checkpoint, most=run.progress.step + STEPS, is_judged=False)
        row = {"network": name, "cpu_s": round(run.progress.cpu_s), "samples": run.progress.samples}
        rows.append({**row, **left_out_scores(run, pool), **_cost(run.network)})
        run.save(checkpoint)
        written.write_text(json.dumps(rows), encoding="utf-8")
        print(_line(rows[-1]), file=sys.stderr, flush=True)
    return rows


@torch.no_grad()
def _cost(network: Network) -> dict[str, float]:
    """Count the parameters; time one crop of 128 px on one thread by torch, median in ms."""
    crop = prepare(torch.zeros(1, 128, 128, 4, dtype=torch.uint8))
    network.eval()
    times = []
    for _ in range(TIMED):
        started = time.process_time()
        network.features(crop.to(memory_format=torch.channels_last))
        times.append(1e3 * (time.process_time() - started))
    size = sum(weights.numel() for weights in network.parameters())
    return {"parameters": size, "torch_ms": float(np.median(times))}


def _line(row: dict[str, Any]) -> str:
    cosines = row["left_out_v2"], row["left_out_edge"]
    return (
        f"{row['network']:26} {row['cpu_s']:5} CPU s {row['samples']:8} samples  cosine"
        f" {cosines[0]:.3f} {cosines[1]:.3f}  classes {row.get('left_out_classes', 0.0):.3f}"
        f"  {row['parameters'] / 1e6:.2f} M  {row['torch_ms']:.1f} ms"
    )


def main() -> int:
    """Read the command line and race."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pool", type=Path, required=True, help="folder of the pool")
    parser.add_argument("--out", type=Path, required=True, help="folder for basis and checkpoints")
    parser.add_argument("--cpu-s", type=float, default=600.0, help="for each (%(default)s)")
    parser.add_argument("--batch", type=int, default=96)
    parser.add_argument("--only", choices=NETWORKS, action="append", help="one of them; repeatable")
    parser.add_argument("--json", action="store_true")
    chosen = parser.parse_args()
    torch.set_num_threads(1)
    chosen.out.mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, Any]] = []
    for name in chosen.only or NETWORKS:
        pool, place = Pool(chosen.pool, chosen.out), name.replace(",", "").replace(" ", "-")
        plan = Plan(shape=NETWORKS[name][0], batch=chosen.batch)
        rows += race(name, plan, pool, chosen.out / place, chosen.cpu_s)
    print(json.dumps({"race": rows}) if chosen.json else "\n".join(map(_line, rows)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
