"""The command line: declares every command and turns errors into one line and an exit code.

Only the module of the command that is run is imported, and its parts when it runs: `serve` knows no
other command, and `--help` appears at once.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import json
import logging
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from functools import partial

from hapticvlm import __version__
from hapticvlm.commands.parsing import Commands, Parser
from hapticvlm.errors import HapticVLMError, UsageError, installing, one_line, out_of_memory

_MODELS = "torch transformers safetensors"
# Modules that a command may need beside the core, and the packages that bring them.
PACKAGES = {
    "matplotlib": "matplotlib",
    "psutil": "psutil",
    "cv2": "opencv-python-headless",
    "torch": _MODELS,
    "transformers": _MODELS,
    "safetensors": _MODELS,
    "statsmodels": "statsmodels",
    "pandas": "statsmodels",
    "onnx": "onnx",
    "httpx2": "httpx2",
    "uvicorn": "uvicorn",
    "ray": "'ray[serve]'",
    "mss": "mss",
}
# The module of each command of this package, below `hapticvlm.commands`.
_OWN = "serve stop stream demo replay recognise scan gallery plate doctor feel bake"
_ELSEWHERE = {"stream": "stream_demo", "demo": "stream_demo", "gallery": "gallery.command"}
MODULES = {name: _ELSEWHERE.get(name, name) for name in _OWN.split()}
# The packages beside this one, with the commands each brings; a wheel has no laboratory. They are
# found by name: entry points would cost a quarter of a second at every call.
PARTS = {
    "hapticvlm_studio": ("evaluate", "calibrate", "study"),
    "hapticvlm_recogniser_app": ("recogniser-app",),
    "hapticvlm_lab": ("chart", "stability", "measure"),
}
FOR_DEVELOPERS = {"evaluate", *PARTS["hapticvlm_recogniser_app"], *PARTS["hapticvlm_lab"]}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return its exit code."""
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(threads, "1")
    for stream in (sys.stdout, sys.stderr):
        # Names and paths may have letters that a pipe's code page lacks, or that no encoding has.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    words = sys.argv[1:] if arguments is None else list(arguments)
    return _guarded(argparse.Namespace(program="hapticvlm", run=partial(_run, words)))


def _run(words: Sequence[str], options: argparse.Namespace) -> int:
    """Parse these words into `options`, and run the command that they name."""
    parser = command_line(words[0] if words else None)
    if not words:
        parser.print_help()
        return 0
    parser.parse_args(words, options)
    logging.basicConfig(
        level=options.log_level.upper(), format="%(asctime)s %(levelname)s %(name)s: %(message)s"
    )
    return int(options.run(options))


def _guarded(options: argparse.Namespace) -> int:
    """Run the command; an error that its user can fix becomes one line and exit code 2."""
    try:
        code: int = options.run(options)
        sys.stdout.flush()  # now, where a disk that is full can still be said
    except KeyboardInterrupt:
        print(f"{options.program}: stopped", file=sys.stderr)
        return 130
    except Exception as error:
        while isinstance(error, ExceptionGroup):  # of the service's tasks: the first that failed
            error = error.exceptions[0]
        if isinstance(error, BrokenPipeError):  # its reader has closed stdout
            _drop_unwritten()
            return 1
        reason = _reason(error)
        if reason is None:
            raise
    else:
        return code
    with suppress(OSError):  # stdout and stderr may be the files that a full disk has no room for
        if getattr(options, "json", False):  # a program that reads stdout gets the error there
            print(json.dumps({"error": reason}))
        else:
            print(f"{options.program}: {reason}", file=sys.stderr)
    _drop_unwritten()
    return 2


def _drop_unwritten() -> None:
    """Drop what cannot be written, which Python would report at its end in words of its own."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _reason(error: Exception) -> str | None:
    """Return what the user can do about an error, in one line; None: it is a bug of ours."""
    if isinstance(error, ModuleNotFoundError):
        name = (error.name or "").partition(".")[0]
        return f"needs {name}: `{installing(PACKAGES[name])}`" if name in PACKAGES else None
    if isinstance(error, HapticVLMError | OSError):
        return one_line(error)
    return out_of_memory(error)


def command_line(named: str | None = None) -> argparse.ArgumentParser:
    """Return the parser of the named command, or of all if there is none of this name.

    docs/command-line.md is written from the whole.
    """
    parser: argparse.ArgumentParser = Parser(
        prog="hapticvlm",
        description="Makes objects in a VR scene feel like what they look like. "
        "`hapticvlm COMMAND --help` explains one command.",
        examples=(
            "hapticvlm demo            try it without hardware",
            "hapticvlm serve           run the service, then open http://127.0.0.1:8790/",
            "hapticvlm feel metal      show what touching metal feels like",
        ),
    )
    parser.add_argument("--version", action="version", version=f"hapticvlm {__version__}")
    parser.add_argument(
        "--log-level",
        default="warning",
        choices=["debug", "info", "warning", "error"],
        help="least severe messages to log on stderr (%(default)s)",
    )
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    parts = [package for package, names in PARTS.items() if named in names]
    if named in MODULES:
        _add_module(commands, MODULES[named])
    elif parts:
        _add_package(commands, parts[0])
    else:
        for module in dict.fromkeys(MODULES.values()):
            _add_module(commands, module)
        for package in PARTS:
            _add_package(commands, package)
    developers = parser.add_argument_group("commands for developers")
    listed = commands._choices_actions  # what --help shows; argparse has no groups of commands
    developers._group_actions += [each for each in listed if each.dest in FOR_DEVELOPERS]
    listed[:] = [each for each in listed if each.dest not in FOR_DEVELOPERS]
    return parser


def _add_module(commands: Commands, module: str) -> None:
    importlib.import_module(f"hapticvlm.commands.{module}").add(commands)


def _add_package(commands: Commands, package: str) -> None:
    """Declare the commands of a package; without it, each is unlisted and says where it is."""
    if importlib.util.find_spec(package) is not None:
        importlib.import_module(f"{package}.commands").add(commands)
        return
    for name in PARTS[package]:
        command = commands.add_parser(name, add_help=False)
        command.add_argument("rest", nargs=argparse.REMAINDER)
        command.set_defaults(run=_refuse_without)


def _refuse_without(_: argparse.Namespace) -> int:
    raise UsageError("comes with the repository, not with the package: run it in a checkout")
