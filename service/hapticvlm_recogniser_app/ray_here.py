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
    import ray
    from ray import serve

    folder = tempfile.mkdtemp(prefix=FOLDER)
    scale = settings.scale
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Ray's own, about its own parts
            _start(ceil(scale.replicas[1] * scale.cpus), folder)
            for name in ("ray", "ray.serve"):
                logging.getLogger(name).setLevel(logging.ERROR)
            serve.start(proxy_location="HeadOnly", http_options=http)
            deploy(settings)
        yield
    finally:
        if ray.is_initialized():
            ray.shutdown()  # not Serve's first: it waits half a minute for a proxy to drain
        shutil.rmtree(Path(folder), ignore_errors=True)


def _start(cores: int, folder: str) -> None:
    import ray

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
        text = f"Ray does not start ({error}); free processor and memory, and try again"
        raise RayError(text) from error


def deploy(settings: AppSettings) -> None:
    """Deploy, or change what is deployed; returns when it is."""
    from ray import serve

    from hapticvlm_recogniser_app.ray_deployment import application

    logs = serve.schema.LoggingConfig(log_level="WARNING", enable_access_log=False)
    name = APPLICATION
    path = "/"
    serve.run(application(settings), name=name, route_prefix=path, logging_config=logs)
