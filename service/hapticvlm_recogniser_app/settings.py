"""Holds the settings of a shared recogniser and its Ray Serve config. Pure; does not import Ray."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from hapticvlm.vision.remote.contract import SHIPPED

IMPORT_PATH = "hapticvlm_recogniser_app.ray_deployment:build"
DEPLOYMENT = "Recogniser"
APPLICATION = "recogniser"
# environment variables: the one token, or a file with a token for each client
TOKEN = "HAPTICVLM_RECOGNISER_TOKEN"
TOKENS = "HAPTICVLM_RECOGNISER_TOKENS"
ADMITTED = "hapticvlm.admitted"  # key of an ASGI scope: the client's name, once its token is known
BATCH = 16  # crops in one batch at most; our choice
WAIT_S = 0.004  # for more of them, on Ray; on one core batches save nothing (shared-recogniser.md)
KEEP_ALIVE_S = 90  # of a client's idle connection; our choice
HEALTH_S = 2.0  # between two health checks of a replica; our choice
HEALTH_TIMEOUT_S = 10.0  # of one health check; our choice
# how long the load must stay high or low before a replica is added or removed
UPSCALE_S = 3.0
DOWNSCALE_S = 60.0
_NAME = re.compile(r"[a-z0-9][a-z0-9._-]{0,63}")


@dataclass(frozen=True, slots=True)
class Model:
    """The settings that each replica loads once; with `is_open` it answers without a token."""

    encoder: str | None = None
    device: str = "cpu"
    is_open: bool = False


@dataclass(frozen=True, slots=True)
class Scale:
    """The number of replicas (least, most), the share of each, and the longest queue."""

    replicas: tuple[int, int] = (1, 1)
    gpus: float = 0.0
    queue: int = 128


@dataclass(frozen=True, slots=True)
class AppSettings:
    """Every setting of a shared recogniser; galleries by name, files or folders."""

    model: Model = field(default_factory=Model)
    galleries: Mapping[str, str] = field(default_factory=dict)
    scale: Scale = field(default_factory=Scale)


def read_gallery_option(text: str) -> tuple[str, str]:
    """Return name and absolute path of NAME=PATH. Raises ValueError."""
    name, equals, path = text.partition("=")
    if not equals or not path or not _NAME.fullmatch(name):
        raise ValueError(f"--gallery {text}: use NAME=PATH, NAME of a-z, 0-9, `.`, `_` and `-`")
    if name == SHIPPED:
        raise ValueError(f"--gallery {text}: the name `{SHIPPED}` is taken by the shipped gallery")
    return name, str(Path(path).expanduser().resolve())


def read_replicas(text: str) -> tuple[int, int]:
    """Return least and most of N or LEAST:MOST. Raises ValueError."""
    least, colon, most = text.partition(":")
    try:
        replicas = int(least), int(most if colon else least)
    except ValueError:
        replicas = (0, 0)
    if not 1 <= replicas[0] <= replicas[1]:
        raise ValueError(f"--replicas {text}: use N or LEAST:MOST, at least 1")
    return replicas


def check(settings: AppSettings) -> None:
    """Check every number against its bounds. Raises ValueError, which names the option."""
    scale = settings.scale
    if not scale.gpus >= 0.0:
        raise ValueError("--gpus must be at least 0; it may be a fraction")
    if scale.queue < 1:
        raise ValueError(f"--queue {scale.queue}: must be at least 1")
    if scale.gpus and settings.model.device == "cpu":
        raise ValueError("--gpus needs --encoder-device cuda: the encoder would leave the GPU idle")


def options(settings: AppSettings) -> dict[str, Any]:
    """Return the options of the deployment, as Ray Serve names them.

    A replica takes twice its batch: one batch is embedded while the next fills. Ray adds a replica
    when more than one batch waits for each of them.
    """
    scale = settings.scale
    return {
        "name": DEPLOYMENT,
        "user_config": {"galleries": dict(settings.galleries)},  # can change while it runs
        "max_ongoing_requests": 2 * BATCH,
        "max_queued_requests": scale.queue,
        "autoscaling_config": {
            "min_replicas": scale.replicas[0],
            "max_replicas": scale.replicas[1],
            "target_ongoing_requests": BATCH,
            "upscale_delay_s": UPSCALE_S,
            "downscale_delay_s": DOWNSCALE_S,
        },
        "health_check_period_s": HEALTH_S,
        "health_check_timeout_s": HEALTH_TIMEOUT_S,
        "graceful_shutdown_timeout_s": 5.0,
        "ray_actor_options": {"num_cpus": 1.0, "num_gpus": scale.gpus},
    }


def http_options(host: str, port: int) -> dict[str, Any]:
    """Return the options of HTTP, as Ray Serve names them."""
    return {"host": host, "port": port, "keep_alive_timeout_s": KEEP_ALIVE_S}


def serve_config(settings: AppSettings, host: str, port: int) -> dict[str, Any]:
    """Return the config for `serve run` and `serve deploy`. It does not contain the token."""
    return {
        "proxy_location": "EveryNode",
        "http_options": http_options(host, port),
        "applications": [
            {
                "name": APPLICATION,
                "route_prefix": "/",
                "import_path": IMPORT_PATH,
                "args": asdict(settings.model),
                "deployments": [options(settings)],
            }
        ],
    }
