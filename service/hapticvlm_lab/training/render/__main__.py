"""`python -m hapticvlm_lab.training.render`: shards of training pictures, or contact sheets."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import torch
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from hapticvlm_lab.training.render.batch import render
from hapticvlm_lab.training.render.light import load_lights
from hapticvlm_lab.training.render.shards import PER_SHARD, Order, make, shards
from hapticvlm_lab.training.render.sheet import save_sheet
from hapticvlm_lab.training.render.surfaces import KINDS
from hapticvlm_lab.training.render.tiles import load_tiles


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit status."""
    options = _parser().parse_args(arguments)
    torch.set_num_threads(1)
    tiles = load_tiles(options.data) if options.data else None
    lights = load_lights(options.data) if options.data else None
    if options.sheet:
        for name in options.sheet:
            names = [name] * max(1, options.count // 4)
            batch = render(options.seed, names, views=4, side=options.side, tiles=tiles,
                           lights=lights, device=options.device)  # fmt: skip
            save_sheet(list(batch.images), 12, options.out / f"{name}.png")
        return 0
    order = Order(options.out, options.count, options.seed, options.side, options.device)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
               TimeRemainingColumn())  # fmt: skip
    with Progress(*columns, console=Console(stderr=True)) as progress:
        task = progress.add_task("pictures", total=len(shards(order)) * PER_SHARD)
        for path in make(order, tiles, lights):
            progress.update(task, advance=PER_SHARD, description=path.name)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m hapticvlm_lab.training.render", description=__doc__
    )
    parser.add_argument("--out", type=Path, required=True, help="folder of the shards or sheets")
    parser.add_argument("--count", type=int, default=PER_SHARD, help="pictures (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="runs side by side need other seeds")
    parser.add_argument(
        "--data", type=Path, help="data folder with tiles and HDRIs (none: without)"
    )
    parser.add_argument("--side", type=int, default=144, help="px (%(default)s)")
    parser.add_argument("--device", default="cpu", help="cpu or cuda (%(default)s)")
    parser.add_argument("--sheet", nargs="+", choices=sorted(KINDS), metavar="MATERIAL",
                        help="write a contact sheet of each instead of shards")  # fmt: skip
    return parser


if __name__ == "__main__":
    sys.exit(main())
