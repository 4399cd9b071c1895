"""`hapticvlm recogniser-app`: one recogniser for many services, on one machine or on a cluster.

Runs it until it is asked to stop, in one process on uvicorn or on a local Ray, or writes the config
for `serve run` and `serve deploy` of Ray. Needs the extra `fleet`, or `ray` for Ray.
"""

from __future__ import annotations

import argparse
import functools
import importlib.util
import os
import signal
import socket
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm import documents
from hapticvlm.commands.parsing import add_encoder
from hapticvlm.errors import UsageError, usage_errors

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm_recogniser_app.settings import AppSettings

PORT = 8791
UVICORN = "uvicorn"
RAY = "ray"
ENGINES = (UVICORN, RAY)


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    app = commands.add_parser(
        "recogniser-app",
        help="run one recogniser for many services",
        description="Run one recogniser that many services share: one process on this machine "
        "(uvicorn), or replicas on many nodes and GPUs (Ray). Or write the config for `serve run` "
        "and `serve deploy` of Ray.",
        examples=(
            "hapticvlm recogniser-app",
            "hapticvlm recogniser-app --engine ray --replicas 2",
            "hapticvlm recogniser-app --replicas 1:4 --gpus 0.25 --write recogniser.yaml",
        ),
    )
    app.set_defaults(run=_run)
    app.add_argument(
        "--engine",
        choices=ENGINES,
        help="server: uvicorn, one process (for more cores run one per core behind a proxy), or "
        "ray, for many nodes and shares of a GPU (uvicorn; with --write ray)",
    )
    app.add_argument("--host", default="127.0.0.1", help="address to listen on (%(default)s)")
    app.add_argument(
        "--port", type=int, default=PORT, metavar="PORT", help="port to listen on (%(default)s)"
    )
    app.add_argument(
        "--tls-cert", type=Path, metavar="FILE", help="serve https with this PEM certificate"
    )
    app.add_argument(
        "--tls-key", type=Path, metavar="FILE", help="private key of the certificate, PEM"
    )
    app.add_argument(
        "--gallery",
        action="append",
        default=[],
        metavar="NAME=PATH",
        help="gallery file or folder that services request by this name (repeatable)",
    )
    add_encoder(app)
    app.add_argument(
        "--encoder-device",
        choices=("cpu", "cuda", "auto"),
        default="cpu",
        help="device for a network of transformers (%(default)s)",
    )
    replicas = app.add_argument_group("replicas, on Ray")
    replicas.add_argument("--replicas", metavar="N_OR_LEAST:MOST", help="number of replicas (1)")
    replicas.add_argument(
        "--gpus",
        type=float,
        metavar="N",
        help="GPUs for each replica; with 0.25 four replicas share one (0)",
    )
    app.add_argument(
        "--queue",
        type=int,
        default=128,
        metavar="N",
        help="longest queue of requests; further ones get 503 (%(default)s)",
    )
    app.add_argument(
        "--write",
        type=Path,
        metavar="FILE",
        help="write the config for `serve deploy` and run nothing",
    )


def _run(options: argparse.Namespace) -> int:
    engine = options.engine or (UVICORN if options.write is None else RAY)
    if importlib.util.find_spec(engine) is None:  # Ray is imported only once its environment is set
        raise ModuleNotFoundError(name=engine)
    with usage_errors():
        settings = settle(options, engine, os.environ)
    if options.write is not None:
        _write(settings, options)
        return 0
    run = _run_on_ray if engine == RAY else _run_on_uvicorn
    run(settings, options)
    print("recogniser stopped", flush=True)
    return 0


def settle(options: argparse.Namespace, engine: str, environment: os._Environ[str]) -> AppSettings:
    """Return the settings that the options ask for. Raises ValueError, which names the option."""
    from hapticvlm.server.addresses import is_loopback
    from hapticvlm_recogniser_app import settings as app
    from hapticvlm_recogniser_app.tokens import MIN_TOKEN, Tokens

    tokens = Tokens(environment)
    if not is_loopback(options.host) and not tokens.are_long and options.write is None:
        raise UsageError(
            f"--host {options.host} is reachable from other machines: set {app.TOKEN} to a secret "
            f"of at least {MIN_TOKEN} characters, or {app.TOKENS} to a file of them"
        )
    if (options.tls_cert is None) != (options.tls_key is None):
        raise UsageError("--tls-cert and --tls-key belong together: give both options")
    if engine != RAY:
        _refuse_ray_options(options)
    is_open = tokens.is_open and options.write is None
    settings = app.AppSettings(
        app.Model(options.encoder, options.encoder_device, is_open),
        dict(app.read_gallery_option(text) for text in options.gallery),
        app.Scale(app.read_replicas(options.replicas or "1"), options.gpus or 0.0, options.queue),
    )
    app.check(settings)
    return settings


def _refuse_ray_options(options: argparse.Namespace) -> None:
    """Refuse the options that only Ray supports. Raises UsageError."""
    if options.write is not None:
        raise UsageError("--write writes a config for Ray: omit --engine, or use --engine ray")
    for name in ("replicas", "gpus"):
        if getattr(options, name) is not None:
            raise UsageError(
                f"--{name} needs --engine ray; without Ray, run one process per core or GPU behind "
                "a proxy"
            )


def _write(settings: AppSettings, options: argparse.Namespace) -> None:
    import yaml

    from hapticvlm_recogniser_app.settings import serve_config

    config = serve_config(settings, options.host, options.port)
    documents.replace_file(options.write, yaml.safe_dump(config, sort_keys=False))
    command = f"RAY_worker_niceness=0 serve run {options.write}"
    print(f"wrote {options.write}; run it with `{command}`,")
    print("or use `serve deploy` on a cluster whose nodes set RAY_worker_niceness=0")


def _run_on_uvicorn(settings: AppSettings, options: argparse.Namespace) -> None:
    import asyncio

    from hapticvlm.commands.service_address import port_errors
    from hapticvlm.server import log_writer
    from hapticvlm_recogniser_app import engine_uvicorn

    log_writer.take_over()  # a log that nobody reads must not hold up an answer
    certificate = None if options.tls_cert is None else (options.tls_cert, options.tls_key)
    family = socket.AF_INET6 if ":" in options.host else socket.AF_INET
    with port_errors(options.port, options.host):
        listener = socket.create_server((options.host, options.port), family=family, backlog=256)
    with listener:
        port = listener.getsockname()[1]
        ready = functools.partial(_print_ready, settings, options, port)
        server = engine_uvicorn.Server(settings, certificate, ready)
        # From here on a signal ends the server in order. uvicorn installs its own handlers while it
        # serves and raises the signal again afterwards, for these handlers. Before this line, while
        # a large network is loaded, a signal ends the process.
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: server.leave())
        asyncio.run(server.serve(sockets=[listener]))


def _run_on_ray(settings: AppSettings, options: argparse.Namespace) -> None:
    from hapticvlm_recogniser_app.engine_ray import running
    from hapticvlm_recogniser_app.settings import http_options

    http = http_options(options.host, options.port)
    if options.tls_cert is not None:
        http |= {"ssl_certfile": str(options.tls_cert), "ssl_keyfile": str(options.tls_key)}
    stopping = threading.Event()
    with running(settings, http):
        for number in (signal.SIGINT, signal.SIGTERM):  # after Ray has installed its own handlers
            signal.signal(number, lambda *_: stopping.set())
        _print_ready(settings, options, options.port)
        stopping.wait()


def _print_ready(settings: AppSettings, options: argparse.Namespace, port: int) -> None:
    host = f"[{options.host}]" if ":" in options.host else options.host
    scheme = "http" if options.tls_cert is None else "https"
    print(f"recogniser ready on {scheme}://{host}:{port}/", flush=True)
    print(f"  galleries    {', '.join(('shipped', *settings.galleries))}")
    print(
        f"  token        {'none: loopback only' if settings.model.is_open else 'required'}",
        flush=True,
    )
