"""Checks this machine for `hapticvlm doctor`: Python, packages, clock, priority, encoder."""

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

NEWEST_UNTRIED = (3, 14)  # the first Python version without tests
COARSE_SLEEP_S = 0.005  # a tick of the gateway is 20 ms
BUILT_AT = 1735689600.0  # 2025-01-01: a clock before it makes every certificate invalid
SLOW_MS = 50.0  # an inference of the shipped encoder takes 3 ms on a quiet core
EXTRAS = {  # extras of pyproject.toml that a user may want, and their packages
    "models": "torch transformers safetensors",
    "remote": "httpx2",
    "fleet": "uvicorn",
    "video": "opencv-python-headless",
    "screen": "mss",
    "studio": "matplotlib markdown-it-py statsmodels",
}

_REQUIREMENT = re.compile(
    r"(?P<name>[\w.-]+)(?:\[[^]]*\])?\s*(?:>=(?P<least>[\d.]+))?[^;]*"
    r"(?:;.*extra\s*==\s*['\"](?P<extra>\w+)['\"])?"
)


def python() -> Finding:
    """Check which Python runs this and whether the package supports it."""
    version = f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    if sys.maxsize < 2**32:
        cure = "install a 64-bit Python 3.11-3.13"
        return Finding("python", "wrong", f"{version}, 32 bits", cure)
    if sys.version_info[:2] >= NEWEST_UNTRIED:
        return Finding("python", "note", f"{version}, newer than the tested versions")
    return Finding("python", "ok", f"{version}, hapticvlm {__version__}")


def packages() -> list[Finding]:
    """Check for missing or outdated packages, and list the installed extras."""
    try:
        return judged(metadata.requires("hapticvlm") or [])
    except metadata.PackageNotFoundError:
        return [
            Finding(
                "packages", "wrong", "hapticvlm is not installed", "pip install . in its folder"
            )
        ]


def judged(requirements: Sequence[str]) -> list[Finding]:
    """Compare requirements, as a package's metadata states them, with the installed packages."""
    problems: dict[str, list[str]] = {}  # by extra; "" is the core
    for requirement in requirements:
        match = _REQUIREMENT.match(requirement)
        if match is not None and match["name"] != "hapticvlm":
            problem = _problem(match["name"], match["least"])
            problems.setdefault(match["extra"] or "", []).extend([problem] if problem else [])
    core = problems.get("", [])
    cure = "install it again: pip install . in its folder"
    complete = Finding("packages", "ok", f"all {_count(requirements)} that are needed")
    return [
        Finding("packages", "wrong", "; ".join(core), cure) if core else complete,
        _extras(problems),
    ]


def _problem(name: str, least: str | None) -> str | None:
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return f"{name} is missing"
    if least is not None and _numbers(version) < _numbers(least):
        return f"{name} {version} is older than {least}"
    return None


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", version.split("+")[0])[:3])


def _count(requirements: Sequence[str]) -> int:
    return sum("extra" not in requirement for requirement in requirements)


def _extras(problems: dict[str, list[str]]) -> Finding:
    missing = [name for name in EXTRAS if problems.get(name)]
    installed = [name for name in EXTRAS if name not in missing]
    message = f"installed: {', '.join(installed) or 'none'}"
    if not missing:
        return Finding("extras", "ok", message)
    packages = " ".join(EXTRAS[name] for name in missing)
    cure = f"if you need them: {installing(packages)}"
    return Finding("extras", "ok", f"{message}; not installed: {', '.join(missing)}", cure)


def clock() -> Finding:
    """Check whether a short sleep is short, and whether the date is plausible."""
    if time.time() < BUILT_AT:
        message = time.strftime("the date is %Y-%m-%d", time.gmtime())
        return Finding("clock", "wrong", message, "set the clock: certificates need it")
    waits = []
    for _ in range(9):
        started = time.perf_counter()
        time.sleep(0.001)
        waits.append(time.perf_counter() - started)
    waited = statistics.median(waits)
    message = f"a sleep of 1 ms takes {1000.0 * waited:.1f} ms"
    if waited > COARSE_SLEEP_S:
        cure = "the machine is busy, or its timer is coarse: close other programs"
        return Finding("clock", "note", message, cure)
    return Finding("clock", "ok", message)


def priority(options: ServeOptions) -> Finding:
    """Check whether real-time priority is permitted; it is dropped again at once."""
    about = "priority"
    if options.no_realtime:
        return Finding(about, "ok", "normal, because of --no-realtime")
    if sys.platform != "linux":
        return Finding(about, "ok", "set by the audio system")
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError:
        cure = (
            "put '@audio - rtprio 95' into /etc/security/limits.d/audio.conf, join the group "
            "audio, and log in again"
        )
        message = "real-time is not permitted: sound may be interrupted when the machine is busy"
        return Finding(about, "note", message, cure)
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    return Finding(about, "ok", "real-time is permitted")


def encoder(options: ServeOptions) -> Finding:
    """Load the encoder and gallery and recognise once; slow transformers encoders are skipped."""
    from hapticvlm.vision.encoders.encoder import EncoderError
    from hapticvlm.vision.galleries.storage import GalleryError
    from hapticvlm.vision.loading import is_quick

    about = "encoder"
    if not is_quick(options.encoder):
        cure = "try it with `hapticvlm recognise`"
        return Finding(about, "ok", f"{options.encoder}: not loaded, because it is slow", cure)
    try:
        name, took_ms = _inference(options)
    except (EncoderError, GalleryError, OSError, ValueError) as error:
        return Finding(about, "wrong", str(error), "install hapticvlm again, or see --encoder")
    message = f"{name}: {took_ms:.1f} ms per inference"
    if took_ms > SLOW_MS:
        cure = "decisions will be late; close other programs"
        return Finding(about, "note", message, cure)
    return Finding(about, "ok", message)


def _inference(options: ServeOptions) -> tuple[str, float]:
    """Return the encoder's name and the median time of an inference in ms."""
    import numpy as np

    from hapticvlm.vision.galleries.storage import load_gallery
    from hapticvlm.vision.loading import load_encoder
    from hapticvlm.vision.pictures import Crop

    encoder = load_encoder(options.encoder, threads=options.threads)
    load_gallery(options.gallery, encoder=encoder)
    side = encoder.side
    crop = Crop(np.full((side, side, 3), 90, np.uint8), np.full((side, side), 255, np.uint8))
    took = []
    for _ in range(3):
        started = time.perf_counter()
        encoder.embed([crop])
        took.append(1000.0 * (time.perf_counter() - started))
    return encoder.name, statistics.median(took)
