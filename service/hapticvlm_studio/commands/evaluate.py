"""`hapticvlm evaluate`: grades a method on labelled pictures. Connects models to the grades."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json
from hapticvlm.errors import usage_errors

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.vlm.contract import VlmSettings
    from hapticvlm_studio.evaluation.asking import Ask

TOKEN = "HAPTICVLM_VLM_TOKEN"  # environment variable; an option would show in the process list
TIMEOUT_S = 120.0  # long, since no hand waits for the answer


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    evaluate = commands.add_parser(
        "evaluate",
        help="grade a method on your own labelled pictures",
        description="Grade a method on your own labelled pictures, beside constant guesses.",
    )
    subjects = evaluate.add_subparsers(title="subjects", required=True, metavar="WHAT")
    ambient = subjects.add_parser(
        "ambient",
        help="air temperature estimated from pictures",
        description="Grade how well a vision-language model estimates the air temperature from "
        "pictures, and compare it with the default and with a constant guess.",
        examples=("hapticvlm evaluate ambient pictures.csv --vlm",),
    )
    ambient.set_defaults(run=_evaluate_ambient)
    ambient.add_argument(
        "csv",
        type=Path,
        metavar="CSV",
        help="file with the columns image (path relative to the file) and temperature_c",
    )
    ambient.add_argument(
        "--vlm",
        metavar="NAME_OR_FOLDER",
        nargs="?",
        const=True,
        help="grade this image-text model of transformers (without a name: the default model); "
        "with neither --vlm nor --vlm-url the service's default is graded",
    )
    ambient.add_argument(
        "--vlm-url",
        metavar="URL",
        help="ask an OpenAI-compatible endpoint; your pictures are sent there",
    )
    ambient.add_argument(
        "--vlm-header",
        metavar="NAME",
        help="header that carries its token instead of Authorization (api-key for Azure)",
    )
    add_json(ambient)


def _evaluate_ambient(options: argparse.Namespace) -> int:
    from hapticvlm_studio.commands.evaluate_ambient import run
    from hapticvlm_studio.evaluation.pictures import read_pictures

    with usage_errors():
        read_pictures(options.csv)
        method, ask = _method(options)
        return run(options.csv, method, ask, as_json=options.json)


def _method(options: argparse.Namespace) -> tuple[str, Ask]:
    """Return the name of the method and the function that asks it. Raises ValueError, VlmError."""
    from hapticvlm_studio.evaluation.asking import by_default, by_vlm

    if not (options.vlm or options.vlm_url):
        return "default", by_default
    from hapticvlm.vlm.local import load_vlm

    vlm = load_vlm(_settings(options))
    return vlm.name, by_vlm(vlm)


def _settings(options: argparse.Namespace) -> VlmSettings:
    from hapticvlm.vlm.contract import DEFAULT_MODEL, VlmSettings

    return VlmSettings(
        model=options.vlm if isinstance(options.vlm, str) else DEFAULT_MODEL,
        url=options.vlm_url,
        token=os.environ.get(TOKEN),
        header=options.vlm_header,
        timeout_s=TIMEOUT_S,
    )
