"""Chat servers that others wrote, each a process of its own on loopback.

`foreign_servers.txt` has their packages. They pin versions that ours do not, so `make nightly`
installs them into an environment of their own.
"""

from __future__ import annotations

import os
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest
from pace import PACE
from ports import free_port

START_S = 400.0 * PACE  # of a process that imports a web framework, or torch, on a busy machine
FOREIGN = Path(__file__).parents[2] / "build" / "chat-servers" / "bin"


@contextmanager
def chat_server(
    command: Sequence[object], health: str, folder: Path, env: Mapping[str, str] | None = None
) -> Iterator[str]:
    """Run a server with `--port PORT` and yield its url once the path `health` answers.

    It works in `folder` and leaves its log there.
    """
    port = free_port()
    log = folder / "log"
    with log.open("wb") as file:
        process = subprocess.Popen(
            [*map(str, command), "--port", str(port)],
            cwd=folder,
            env=os.environ | dict(env or {}),
            stdout=file,
            stderr=subprocess.STDOUT,
        )
    try:
        url = f"http://127.0.0.1:{port}"
        _await_answer(url + health, process, log)
        yield url
    finally:
        process.terminate()
        process.wait(30.0 * PACE)


def _await_answer(address: str, process: subprocess.Popen[bytes], log: Path) -> None:
    until = time.monotonic() + START_S
    while time.monotonic() < until and process.poll() is None:
        try:
            urllib.request.urlopen(address, timeout=5.0).close()
            return
        except urllib.error.HTTPError:
            return  # a server that does not know the path runs
        except OSError:
            time.sleep(0.5)
    pytest.fail(f"{address} did not answer:\n{log.read_text(encoding='utf-8')[-3000:]}")
