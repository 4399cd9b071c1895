"""Serves the shared recogniser on a local Ray: starts Ray, deploys to it and removes its files.

Ray's usage reports and its dashboard are off.
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
from pathlib import Path
from typing import Any

from hapticvlm.errors import HapticVLMError
from hapticvlm_recogniser_app.settings import APPLICATION, AppSettings

OBJECT_STORE_BYTES = 80 * 1024 * 1024  # crops travel inside calls, not through the store
FOLDER = "hv-ray-"  # short: it holds sockets, whose paths have at most 107 characters
ATTEMPTS = 3  # Ray gives its own processes 30 s to start, too little on a busy machine
PROXY_S = "50"  # until Serve's proxy first answers; Serve itself gives up after 60 s
REMEDY = "free processor and memory, and try again"


class RayError(HapticVLMError):
    """Raised when Ray or Ray Serve does not start; the message holds Ray's own reason."""


@contextmanager
def running(settings: AppSettings, http: dict[str, Any]) -> Iterator[None]:
    """Run the recogniser until the block ends; `http` holds Serve's http options.

    Raises RayError.
    """
    # Ray listens on every interface and runs any code it is sent. A random token, which only this
    # process and its children have, keeps everyone else out.
    os.environ |= {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(32)}
    os.environ.setdefault("RAY_SERVE_THROUGHPUT_OPTIMIZED", "1")
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    # Ray runs its workers at nice 15, which suits batch jobs. A recogniser is waited for: on two
    # cores shared with two busy programs, nice 15 left it a thirtieth of each core.
    os.environ.setdefault("RAY_worker_niceness", "0")
    # Serve kills a proxy that has not answered after 5 s. On a busy machine the proxy is still
    # importing its code then, so each successor would be killed as well.
    os.environ.setdefault("RAY_SERVE_PROXY_READY_CHECK_TIMEOUT_S", PROXY_S)
    import ray

    folder = tempfile.mkdtemp(prefix=FOLDER)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings of Ray about its own modules
            _start(settings.scale.replicas[1], folder)
            for name in ("ray", "ray.serve"):
                logging.getLogger(name).setLevel(logging.ERROR)
            _serve(http)
            deploy(settings)
        yield
    finally:
        if ray.is_initialized():
            ray.shutdown()  # without Serve's shutdown, which waits 30 s for its proxy to drain
        shutil.rmtree(Path(folder), ignore_errors=True)


def _start(cores: int, folder: str) -> None:
    """Start Ray's own processes, and retry where they took too long. Raises RayError."""
    import ray
    from ray._private import services

    # Without the dashboard this process of Ray has usage reports alone to care for. Where they are
    # off it sends none, and yet asks the metadata services of three clouds where it runs.
    services.start_api_server = lambda *_, **__: (None, None)
    for left in reversed(range(ATTEMPTS)):
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
        except Exception as error:  # Ray raises plain Exception here
            ray.shutdown()  # ends the processes that did start
            if not left:
                raise RayError(f"Ray does not start ({error}); {REMEDY}") from error
        else:
            return


def _serve(http: dict[str, Any]) -> None:
    """Start Serve, which answers over HTTP. Raises RayError."""
    from ray import exceptions, serve

    try:
        serve.start(proxy_location="HeadOnly", http_options=http)
    except (exceptions.RayError, TimeoutError) as error:
        reason = str(error).strip().partition("\n")[0]
        raise RayError(f"Ray Serve does not start ({reason}); {REMEDY}") from error


def deploy(settings: AppSettings) -> None:
    """Deploy the recogniser, or update the one deployed; returns once it answers."""
    from ray import serve

    from hapticvlm_recogniser_app.ray_deployment import application

    logs = serve.schema.LoggingConfig(log_level="WARNING", enable_access_log=False)
    name = APPLICATION
    path = "/"
    serve.run(application(settings), name=name, route_prefix=path, logging_config=logs)
