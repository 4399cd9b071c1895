"""`hapticvlm chart ambient`: every method to read a temperature off a picture."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.evaluate.command import TOKEN
from hapticvlm.commands.parsing import add_json

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

OUT = Path("chart-output")


def add_chart(subjects: Commands) -> None:
    """Declare `chart ambient`."""
    ambient = subjects.add_parser("ambient", help="pictures to temperatures: error, time, memory")
    ambient.set_defaults(run=_chart)
    ambient.add_argument(
        "--data", type=Path, metavar="CSV", help="labelled pictures, as `evaluate ambient` takes"
    )
    ambient.add_argument(
        "--model", metavar="FOLDER", help="model by folder or name (random weights)"
    )
    ambient.add_argument(
        "--random",
        choices=["tiny", "full"],
        default="tiny",
        help="size of the random model; full is that of Qwen2-VL-2B, 5 GB (%(default)s)",
    )
    ambient.add_argument(
        "--vlm-device",
        default="cpu",
        metavar="NAME",
        help="where the model runs: cpu or cuda (%(default)s)",
    )
    ambient.add_argument(
        "--device", dest="vlm_device", default=argparse.SUPPRESS, help=argparse.SUPPRESS
    )
    ambient.add_argument("--vlm-url", metavar="URL", help="chart an OpenAI-compatible endpoint too")
    ambient.add_argument(
        "--out",
        type=Path,
        default=OUT,
        metavar="FOLDER",
        help="write picture and JSON here (%(default)s)",
    )
    add_json(ambient)


def _chart(options: argparse.Namespace) -> int:
    import matplotlib  # noqa: F401
    import transformers  # noqa: F401

    from hapticvlm_lab.bench.ambient import chart

    options.out.mkdir(parents=True, exist_ok=True)
    plan = chart.Plan(
        data=options.data,
        model=options.model,
        size=options.random,
        device=options.vlm_device,
        url=options.vlm_url,
        token=os.environ.get(TOKEN),
        out=options.out,
        as_json=options.json,
    )
    return chart.run(plan)
