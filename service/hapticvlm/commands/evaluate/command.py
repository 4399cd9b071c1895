"""`hapticvlm evaluate`: a method against known truths. Wires models to the measurement."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.errors import usage_errors

if TYPE_CHECKING:
    from hapticvlm.commands.evaluate.asking import Ask
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.recognition.vlm.answers import VlmSettings

TOKEN = "HAPTICVLM_VLM_TOKEN"  # of the environment: an option would show in the process list
TIMEOUT_S = 120.0  # nobody's hand waits here


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    evaluate = commands.add_parser("evaluate", help="grade a method on your own labelled pictures")
    subjects = evaluate.add_subparsers(title="subjects", required=True, metavar="WHAT")
    ambient = subjects.add_parser("ambient", help="pictures to air temperatures")
    ambient.set_defaults(run=_evaluate_ambient)
    ambient.add_argument(
        "csv", type=Path, metavar="CSV", help="columns image (relative path), temperature_c"
    )
    ambient.add_argument(
        "--method",
        choices=["default", "vlm"],
        help="what to grade (vlm with --vlm or --vlm-url, else default)",
    )
    ambient.add_argument("--vlm", metavar="NAME", help="model by name or folder")
    ambient.add_argument(
        "--vlm-url", metavar="URL", help="ask an OpenAI-compatible endpoint: pictures go there"
    )
    ambient.add_argument("--out", type=Path, help="folder for plots (none are drawn)")
    ambient.add_argument("--json", action="store_true", help="print the JSON line only")


def _evaluate_ambient(options: argparse.Namespace) -> int:
    from hapticvlm.commands.evaluate.ambient import Plan, run
    from hapticvlm.commands.evaluate.pictures import read_shots

    with usage_errors():
        read_shots(options.csv)
        if options.out is not None:
            import matplotlib  # noqa: F401
        method, ask = _method(options)
        return run(Plan(options.csv, method, options.out, options.json), ask)


def _method(options: argparse.Namespace) -> tuple[str, Ask]:
    """Name the method and make it. Raises ValueError and VlmError."""
    from hapticvlm.commands.evaluate.asking import by_default, by_vlm

    named = options.vlm or options.vlm_url
    method = options.method or ("vlm" if named else "default")
    if method != "vlm" and named:
        raise ValueError(f"--method {method} asks no model: leave out --vlm and --vlm-url")
    if method == "default":
        return "default", by_default
    from hapticvlm.recognition.vlm.load import load_vlm

    vlm = load_vlm(_settings(options))
    return vlm.name, by_vlm(vlm)


def _settings(options: argparse.Namespace) -> VlmSettings:
    from hapticvlm.recognition.vlm.answers import DEFAULT_MODEL, VlmSettings

    return VlmSettings(
        model=options.vlm or DEFAULT_MODEL,
        url=options.vlm_url,
        token=os.environ.get(TOKEN),
        timeout_s=TIMEOUT_S,
    )
