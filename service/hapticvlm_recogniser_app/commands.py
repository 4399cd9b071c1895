"""`hapticvlm recogniser-app`: one recogniser for many services, on this machine or on a cluster.

Runs it here until it is asked to stop, or writes the config that `serve run` and `serve deploy` of
Ray take. Needs the extra `ray`.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import signal
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticvlm.errors import UsageError, usage_errors

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm_recogniser_app.settings import AppSettings

LEAST_TOKEN = 12  # characters, off loopback, as of the service
PORT = 8791


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    app = commands.add_parser(
        "recogniser-app",
        help="run one recogniser for many services (needs Ray Serve)",
        description="Run one recogniser that many services share, on this machine or on a cluster. "
        "Or write the config that `serve run` and `serve deploy` of Ray take.",
        examples=(
            "hapticvlm recogniser-app --replicas 2",
            "hapticvlm recogniser-app --replicas 1:4 --gpus 0.25 --write recogniser.yaml",
        ),
    )
    app.set_defaults(run=_run)
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
        help="a gallery file or folder that services ask for by this name (repeatable)",
    )
    app.add_argument(
        "--encoder", metavar="NAME_OR_FILE", help="image network, as in `serve` (the shipped one)"
    )
    devices = ("cpu", "cuda", "auto")
    app.add_argument(
        "--encoder-device",
        choices=devices,
        default="cpu",
        help="where a network of transformers runs (%(default)s)",
    )
    app.add_argument(
        "--device",
        dest="encoder_device",
        choices=devices,
        default=argparse.SUPPRESS,
        help=argparse.SUPPRESS,
    )
    app.add_argument(
        "--threads", type=int, default=1, metavar="N", help="CPU threads of one batch (%(default)s)"
    )
    scale = app.add_argument_group("replicas and batches")
    scale.add_argument(
        "--replicas", default="1", metavar="N|LEAST:MOST", help="how many replicas (%(default)s)"
    )
    scale.add_argument(
        "--cpus", type=float, default=1.0, metavar="N", help="CPUs for each replica (%(default)s)"
    )
    scale.add_argument(
        "--gpus",
        type=float,
        default=0.0,
        metavar="N",
        help="GPUs for each replica; with 0.25 four share one (%(default)s)",
    )
    scale.add_argument(
        "--batch", type=int, default=16, metavar="N", help="most crops in one batch (%(default)s)"
    )
    scale.add_argument(
        "--batch-wait-ms",
        type=float,
        default=4.0,
        metavar="MS",
        help="time a batch may take to fill (%(default)s)",
    )
    scale.add_argument(
        "--queue",
        type=int,
        default=128,
        metavar="N",
        help="most requests that wait; more get 503 (%(default)s)",
    )
    app.add_argument(
        "--write",
        type=Path,
        metavar="FILE",
        help="write the config for `serve deploy` and run nothing",
    )


def _run(options: argparse.Namespace) -> int:
    if importlib.util.find_spec("ray") is None:  # imported only once its environment is set
        raise ModuleNotFoundError(name="ray")
    from hapticvlm_recogniser_app.settings import serve_config

    with usage_errors():
        settings = settle(options, os.environ)
    if options.write is not None:
        import yaml

        config = serve_config(settings, options.host, options.port)
        options.write.write_text(yaml.safe_dump(config, sort_keys=False), "utf-8")
        print(f"{options.write}: `serve run {options.write}`, or `serve deploy` on a cluster")
        return 0
    return _run_here(settings, options)


def settle(options: argparse.Namespace, environment: os._Environ[str]) -> AppSettings:
    """Return what is to be run. Raises ValueError, naming the option."""
    from hapticvlm.server.web.http import is_loopback
    from hapticvlm_recogniser_app import settings as app

    token = environment.get(app.TOKEN)
    if not is_loopback(options.host) and len(token or "") < LEAST_TOKEN and options.write is None:
        raise UsageError(
            f"--host {options.host} is reached by others: set {app.TOKEN}, {LEAST_TOKEN} characters"
        )
    if (options.tls_cert is None) != (options.tls_key is None):
        raise UsageError("--tls-cert and --tls-key go together: state both")
    is_open = token is None and options.write is None
    found = app.AppSettings(
        app.Model(options.encoder, options.encoder_device, options.threads, is_open),
        app.Live(
            dict(app.read_gallery_option(text) for text in options.gallery),
            options.batch,
            options.batch_wait_ms,
        ),
        app.Scale(app.read_replicas(options.replicas), options.cpus, options.gpus, options.queue),
    )
    app.check(found)
    return found


def _run_here(settings: AppSettings, options: argparse.Namespace) -> int:
    from hapticvlm_recogniser_app.local import running

    http: dict[str, Any] = {"host": options.host, "port": options.port, "keep_alive_timeout_s": 90}
    scheme = "http"
    if options.tls_cert is not None:
        http |= {"ssl_certfile": str(options.tls_cert), "ssl_keyfile": str(options.tls_key)}
        scheme = "https"
    stopping = threading.Event()
    with running(settings, http):
        for number in (signal.SIGINT, signal.SIGTERM):  # after Ray, which takes them for itself
            signal.signal(number, lambda *_: stopping.set())
        url = f"{scheme}://{options.host}:{options.port}/"
        print(f"recogniser ready on {url}", flush=True)
        names = ", ".join(("shipped", *settings.live.galleries))
        print(f"  galleries    {names}", flush=True)
        print(f"  token        {'none: loopback only' if settings.model.is_open else 'needed'}")
        sys.stdout.flush()
        stopping.wait()
    print("recogniser stopped", flush=True)
    return 0
