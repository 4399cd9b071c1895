"""The command line: the only place that wires parts together. Imports late, to start at once."""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import logging
import os
import sys
from collections.abc import Sequence

from hapticvlm import __version__
from hapticvlm.commands import (
    completion,
    recognise,
    recogniser_app,
    record_replay,
    serve,
    stop,
    stream_demo,
    study,
)
from hapticvlm.commands.calibrate import thermal as calibrate
from hapticvlm.commands.doctor import command as doctor
from hapticvlm.commands.evaluate import command as evaluate
from hapticvlm.commands.export import command as export
from hapticvlm.commands.feel import command as feel
from hapticvlm.commands.gallery import command as gallery
from hapticvlm.commands.parsing import Commands, Parser
from hapticvlm.commands.plate import command as plate
from hapticvlm.errors import HapticVLMError, UsageError, installing, line

_MODELS = "torch transformers safetensors"
# What a command may need beside the core, and the packages that bring it.
PACKAGES = {
    "matplotlib": "matplotlib",
    "psutil": "psutil",
    "av": "av",
    "cv2": "opencv-python-headless",
    "torch": _MODELS,
    "transformers": _MODELS,
    "safetensors": _MODELS,
    "statsmodels": "statsmodels",
    "pandas": "statsmodels",
    "onnx": "onnx",
    "openvino": "openvino",
    "mitsuba": "mitsuba",
    "ray": "'ray[serve]'",
}
LAB = "hapticvlm_lab"  # lies beside this package in the repository, and in no wheel
LAB_COMMANDS = {
    "chart": "draw accuracy against latency for every method",
    "stability": "draw under which conditions a method fails",
    "measure": "measure latency, memory and stops of this service",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return its exit code."""
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(threads, "1")
    parser = _parser()
    given = sys.argv[1:] if arguments is None else list(arguments)
    if not given:
        parser.print_help()
        return 0
    options = parser.parse_args(given)
    logging.basicConfig(
        level=options.log_level.upper(), format="%(asctime)s %(levelname)s %(name)s: %(message)s"
    )
    return _guarded(options)


def _guarded(options: argparse.Namespace) -> int:
    """Run the command; what its user can mend becomes one line and the exit code 2."""
    try:
        code: int = options.run(options)
    except KeyboardInterrupt:
        print(f"{options.program}: stopped", file=sys.stderr)
        return 130
    except BrokenPipeError:  # who reads has seen enough; nothing more may be flushed to it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except ModuleNotFoundError as error:
        name = (error.name or "").partition(".")[0]
        if name not in PACKAGES:
            raise
        text = f"needs {name}: `{installing(PACKAGES[name])}`"
    except (HapticVLMError, OSError) as error:
        text = line(error)
    else:
        return code
    print(f"{options.program}: {text}", file=sys.stderr)
    return 2


def _parser() -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = Parser(
        prog="hapticvlm",
        description="Makes objects in a VR scene feel like what they look like. "
        "`hapticvlm COMMAND --help` explains one command.",
        examples=(
            "hapticvlm demo            see it work, without hardware",
            "hapticvlm serve           run the service, then open http://127.0.0.1:8790/",
            "hapticvlm feel metal      what touching metal would feel like",
        ),
    )
    parser.add_argument("--version", action="version", version=f"hapticvlm {__version__}")
    parser.add_argument(
        "--log-level",
        default="warning",
        choices=["debug", "info", "warning", "error"],
        help="how much to report on stderr (%(default)s)",
    )
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for part in (
        serve,
        stop,
        stream_demo,
        record_replay,
        recognise,
        feel,
        export,
        gallery,
        evaluate,
        calibrate,
        plate,
        study,
        recogniser_app,
        doctor,
    ):
        part.add(commands)
    _add_lab(commands)
    completion.add(commands, parser)
    return parser


def _add_lab(commands: Commands) -> None:
    """Declare the laboratory's commands; without it, each names where to get it."""
    if importlib.util.find_spec(LAB) is not None:
        importlib.import_module(f"{LAB}.commands").add(commands)
        return
    for name, text in LAB_COMMANDS.items():
        command = commands.add_parser(name, help=f"{text} (in the repository)", add_help=False)
        command.add_argument("rest", nargs=argparse.REMAINDER)
        command.set_defaults(run=_refuse_without_lab)


def _refuse_without_lab(_options: argparse.Namespace) -> int:
    raise UsageError("comes with the repository, not with the package: run it in a checkout")
