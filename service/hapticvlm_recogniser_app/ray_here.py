"""A whole Ray on this machine for one recogniser: started, watched, and taken apart with its files.

Ray's reports to its makers and its dashboard are off.
"""

from __future__ import annotations

import logging
import os
import secrets
import shutil
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from math import ceil
from pathlib import Path
from typing import Any

from hapticvlm.errors import HapticVLMError
from hapticvlm_recogniser_app.settings import APPLICATION, AppSettings

OBJECT_STORE_BYTES = 80 * 1024 * 1024  # crops travel inside calls, not through the store
FOLDER = "hv-ray-"  # short: sockets lie in it, whose paths have at most 107 characters
TRIES = 3  # Ray gives its own processes 30 s to start, too little on a busy machine
PROXY_S = "50"  # for Serve's proxy to answer first, below the 60 s after which Serve gives up
CURE = "free processor and memory, and try again"


class RayError(HapticVLMError):
    """Ray that does not start; the text is its own."""


@contextmanager
def running(settings: AppSettings, http: dict[str, Any]) -> Iterator[None]:
    """Run the recogniser until the block ends. `http` are Serve's http options."""
    # Ray listens on every interface and runs what it is sent: with a token that nobody else has.
    os.environ |= {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(32)}
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_SERVE_THROUGHPUT_OPTIMIZED", "1")
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    # Ray puts its workers behind all other programs (nice 15), for jobs that may take all night.
    # Beside two busy programs on two cores a recogniser that somebody waits for then got a
    # thirtieth of each core.
    os.environ.setdefault("RAY_worker_niceness", "0")
    # Serve kills a proxy that has not answered after 5 s, which on a busy machine is while it still
    # imports its code, and so never has one.
    os.environ.setdefault("RAY_SERVE_PROXY_READY_CHECK_TIMEOUT_S", PROXY_S)
    import ray

    folder = tempfile.mkdtemp(prefix=FOLDER)
    scale = settings.scale
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Ray's own, about its own parts
            _start(ceil(scale.replicas[1] * scale.cpus), folder)
            for name in ("ray", "ray.serve"):
                logging.getLogger(name).setLevel(logging.ERROR)
            _serve(http)
            deploy(settings)
        yield
    finally:
        if ray.is_initialized():
            ray.shutdown()  # not Serve's first: it waits half a minute for a proxy to drain
        shutil.rmtree(Path(folder), ignore_errors=True)


def _start(cores: int, folder: str) -> None:
    """Start Ray's own processes, again where they took too long. Raises RayError."""
    import ray

    for left in reversed(range(TRIES)):
        try:
            ray.init(
                address="local",
                num_cpus=cores,
                object_store_memory=OBJECT_STORE_BYTES,
                include_dashboard=False,
                _temp_dir=folder,
                log_to_driver=False,
                logging_level="error",
            )
        except Exception as error:  # Ray has no class of its own for this
            ray.shutdown()  # what of it had started
            if not left:
                raise RayError(f"Ray does not start ({error}); {CURE}") from error
        else:
            return


def _serve(http: dict[str, Any]) -> None:
    """Start Serve, which answers over HTTP. Raises RayError."""
    from ray import exceptions, serve

    try:
        serve.start(proxy_location="HeadOnly", http_options=http)
    except (exceptions.RayError, TimeoutError) as error:
        reason = str(error).strip().partition("\n")[0]
        raise RayError(f"Ray Serve does not start ({reason}); {CURE}") from error


def deploy(settings: AppSettings) -> None:
    """Deploy, or change what is deployed; returns when it is."""
    from ray import serve

    from hapticvlm_recogniser_app.ray_deployment import application

    logs = serve.schema.LoggingConfig(log_level="WARNING", enable_access_log=False)
    name = APPLICATION
    path = "/"
    serve.run(application(settings), name=name, route_prefix=path, logging_config=logs)
