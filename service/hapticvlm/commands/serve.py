"""`hapticvlm serve` runs the service that a scene connects to.

An option is read from its flag, else from the environment, else from the config file.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticvlm.commands.service_address import port_errors
from hapticvlm.errors import UsageError, usage_errors
from hapticvlm.server.options import Option, check_ranges
from hapticvlm.server.settings import GROUPS, OPTIONS, ServeOptions

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.server.assemble import ServiceParts

MIN_ADDRESS_SPACE_MB = 768  # our choice: 450 was enough each time on two cores, 400 was not


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    serve = commands.add_parser(
        "serve",
        help="run the service that a scene connects to",
        description="Run the service that a scene connects to. Open its address in a browser to "
        "see the dashboard. Ctrl-C stops it and brings the outputs to rest. Devices are simulated "
        "unless --speaker and --peltier name real ones.",
        examples=(
            "hapticvlm serve",
            "hapticvlm serve --speaker default --peltier auto",
            "hapticvlm serve --lan",
            "hapticvlm serve --record sessions",
        ),
    )
    serve.set_defaults(run=_serve)
    add_flags(serve)


def _serve(options: argparse.Namespace) -> int:
    _check_address_space()
    from hapticvlm.server import assemble

    if options.log_level == "warning":
        logging.getLogger("hapticvlm").setLevel(logging.INFO)
    logging.getLogger("websockets").setLevel(logging.WARNING)
    with usage_errors():
        serve_options = resolve_options(options)
        if sys.stderr.isatty():
            print("hapticvlm serve: starting the outputs and the recogniser ...", file=sys.stderr)
        parts = assemble.build_service(serve_options)
        try:
            parts.begin()
            _run_parts(serve_options, parts)
        finally:
            parts.close()  # also after an error before anything ran; a second call does nothing
    return 0


def _check_address_space() -> None:
    """Raise UsageError if the system allows less address space than the service needs.

    Where memory ends while the service starts, no handler can be relied on: a numerical library
    ends the process by itself, and a thread that cannot begin leaves the one that started it
    waiting for ever. So this is asked before the first of them is imported.
    """
    try:
        import resource
    except ImportError:  # Windows limits no address space
        return
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY and limit < MIN_ADDRESS_SPACE_MB * 1024**2:
        raise UsageError(
            f"this shell allows {limit // 1024**2} MB of memory (ulimit -v) and the service needs "
            f"{MIN_ADDRESS_SPACE_MB}: raise the limit, as with `ulimit -v unlimited`"
        )


def _run_parts(options: ServeOptions, parts: ServiceParts) -> None:
    """Run the service; its modules are imported while its processes start."""
    from hapticvlm.commands import run_service
    from hapticvlm.server import service_info

    where = service_info.address(options)
    with port_errors(options.port, options.host):
        run_service.run(options, where, parts)


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Declare --config and a flag for each option."""
    parser.add_argument(
        "--config",
        type=Path,
        metavar="FILE",
        help="read options from this TOML file, under the names below without the dashes; an "
        "option on the command line overrides it",
    )
    for group, title in GROUPS.items():
        flags = parser.add_argument_group(title)
        for option in OPTIONS:
            if option.details.group == group:
                flags.add_argument(option.flag, **_argument(option))


def resolve_options(
    arguments: argparse.Namespace, environment: Mapping[str, str] = os.environ
) -> ServeOptions:
    """Return the service's options. Raises ValueError naming the flag, or the file and field."""
    from hapticvlm.commands import config_file

    values = config_file.read(arguments.config) if arguments.config is not None else {}
    values |= {
        option.field: environment[option.details.env]
        for option in OPTIONS
        if option.details.env and environment.get(option.details.env)
    }
    flags = {
        option.field: getattr(arguments, option.field)
        for option in OPTIONS
        if hasattr(arguments, option.field)
    }
    check_ranges(OPTIONS, flags)
    options = ServeOptions(**_frozen(values | flags))
    if not options.lan:
        return options
    from hapticvlm.server.web import lan

    with usage_errors():
        return lan.opened(options)


def _argument(option: Option) -> dict[str, Any]:
    """Return the keywords of `add_argument`; a flag that is not given sets no attribute."""
    summary = option.details.help
    if option.default not in (None, False, ()):
        summary += f" ({option.default})"
    argument: dict[str, Any] = {"default": argparse.SUPPRESS, "help": summary}
    if option.kind is bool:
        return argument | {"action": "store_true"}
    argument["metavar"] = option.details.metavar
    if option.choices:
        return argument | {"choices": option.choices}
    if option.kind == tuple[str, ...]:
        return argument | {"action": "append"}
    if option.details.bare is not None:
        argument |= {"nargs": "?", "const": option.details.bare}
    return argument | {"type": option.details.read or option.kind}


def _frozen(values: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: tuple(value) if isinstance(value, list) else value for name, value in values.items()
    }
