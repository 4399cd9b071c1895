"""`hapticvlm serve`: runs the service a scene connects to, with its flags.

A flag wins over the environment, that over the config file, that over the default.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticvlm.commands.reaching import port_errors
from hapticvlm.commands.serve_config import GROUPS, OPTIONS, Option, Serving, check_ranges
from hapticvlm.errors import usage_errors

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    serve = commands.add_parser(
        "serve",
        help="run the service that a scene connects to",
        description="Run the service that a scene connects to. Open its address in a browser to "
        "see the dashboard. Ctrl-C ends it and brings the outputs to rest. Devices are simulated "
        "unless --speaker and --peltier name others.",
        examples=(
            "hapticvlm serve",
            "hapticvlm serve --speaker default --peltier auto",
            "hapticvlm serve --host 0.0.0.0 --token SECRET --pages-from lan",
        ),
    )
    add_options(serve)


def add_options(parser: argparse.ArgumentParser, *, but: tuple[str, ...] = ()) -> None:
    """Have the command run the service, with all options `but` those it declares itself."""
    parser.set_defaults(run=_serve)
    add_flags(parser, but=but)


def _serve(options: argparse.Namespace) -> int:
    import asyncio

    from hapticvlm.commands import assemble

    if options.log_level == "warning":
        logging.getLogger("hapticvlm").setLevel(logging.INFO)
    logging.getLogger("websockets").setLevel(logging.WARNING)
    with usage_errors():
        serving = settle(options)
        if sys.stderr.isatty():
            print("hapticvlm serve: starting the outputs and the recogniser ...", file=sys.stderr)
        with port_errors(serving.port):
            asyncio.run(assemble.run(serving, assemble.address(serving)))
    return 0


def add_flags(parser: argparse.ArgumentParser, *, but: tuple[str, ...] = ()) -> None:
    """Declare --config and a flag for each option `but` those the parser has by itself."""
    parser.add_argument(
        "--config",
        type=Path,
        metavar="FILE",
        help="read options from this TOML file; they have the names below, and a flag wins",
    )
    for group, title in GROUPS.items():
        shown = [one for one in OPTIONS if one.told.group == group and one.field not in but]
        if shown:
            flags = parser.add_argument_group(title)
            for option in shown:
                flags.add_argument(option.flag, **_argument(option))
                if option.told.former is not None:
                    hidden = {"dest": option.field, "help": argparse.SUPPRESS}
                    flags.add_argument(f"--{option.told.former}", **{**_argument(option), **hidden})


def settle(given: argparse.Namespace, environment: Mapping[str, str] = os.environ) -> Serving:
    """Return what is to be run. Raises ValueError, naming the flag or the file and its field."""
    from hapticvlm.commands import config_file

    told = config_file.read(given.config) if given.config is not None else {}
    told |= {
        one.field: environment[one.told.env]
        for one in OPTIONS
        if one.told.env and environment.get(one.told.env)
    }
    flags = {one.field: getattr(given, one.field) for one in OPTIONS if hasattr(given, one.field)}
    check_ranges(flags)
    return Serving(**_frozen(told | flags))


def _argument(option: Option) -> dict[str, Any]:
    """Return what argparse is to know; a flag that is not given leaves no trace."""
    text = option.told.help.replace("%(default)s", str(option.default))
    told: dict[str, Any] = {"default": argparse.SUPPRESS, "help": text}
    if option.kind is bool:
        return told | {"action": "store_true"}
    told["metavar"] = option.told.metavar
    if option.choices:
        return told | {"choices": option.choices}
    if option.kind == tuple[str, ...]:
        return told | {"action": "append"}
    if option.told.bare is not None:
        told |= {"nargs": "?", "const": option.told.bare}
    return told | {"type": option.told.read or option.kind}


def _frozen(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: tuple(v) if isinstance(v, list) else v for name, v in values.items()}
