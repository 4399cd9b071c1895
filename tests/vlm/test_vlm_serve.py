"""The remote model against a real `transformers serve`, a process of its own on loopback.

It serves a tiny LLaVA with a planted answer, not a Qwen2-VL, whose processor needs torchvision.
"""

import os
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from pace import PACE
from ports import free_port
from tiny_llava import write_llava
from toolchains import require

from hapticvlm.vlm.contract import VlmError, VlmSettings
from hapticvlm.vlm.remote import RemoteVlm, RestingError

START_S = 400.0 * PACE  # of a process that imports torch and a web framework on a busy machine
ANSWER_S = 120.0 * PACE
NEEDED = ("torch", "transformers", "fastapi", "uvicorn", "openai", "accelerate")
PICTURE = np.random.default_rng(2).integers(0, 255, (120, 160, 3), dtype=np.uint8)

pytestmark = [pytest.mark.nightly, pytest.mark.slow, pytest.mark.process]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    require(*NEEDED)
    return write_llava(tmp_path_factory.mktemp("served"), "21")


@pytest.fixture(scope="module")
def served(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The url of a server on the folder's model."""
    home = tmp_path_factory.mktemp("home")
    (home / "hub").mkdir()  # without it GET /v1/models fails
    port = free_port()
    command = [sys.executable, "-c", "from transformers.cli.transformers import main; main()"]
    options = ["serve", str(folder), "--port", str(port), "--device", "cpu"]
    quiet = {"HF_HOME": str(home), "HF_HUB_OFFLINE": "1", "OMP_NUM_THREADS": "1"}
    log = home / "log"
    with log.open("wb") as file:
        process = subprocess.Popen(
            [*command, *options], env=os.environ | quiet, stdout=file, stderr=subprocess.STDOUT
        )
    try:
        url = f"http://127.0.0.1:{port}"
        await_health(url, process, log)
        yield url
    finally:
        process.terminate()
        process.wait(30.0)


def await_health(url: str, process: subprocess.Popen[bytes], log: Path) -> None:
    until = time.monotonic() + START_S
    while time.monotonic() < until and process.poll() is None:
        try:
            with urllib.request.urlopen(f"{url}/health", timeout=5.0) as answer:
                assert answer.status == 200
                return
        except (urllib.error.URLError, OSError):
            time.sleep(0.5)
    pytest.fail(f"transformers serve did not start:\n{log.read_text()[-3000:]}")


def vlm(url: str, model: str) -> RemoteVlm:
    return RemoteVlm(VlmSettings(url=url, model=model, timeout_s=ANSWER_S))


def test_a_served_model_is_asked_and_read(served: str, folder: Path) -> None:
    reading = vlm(served, str(folder)).ambient(PICTURE)
    assert (reading.value_c, reading.low_c, reading.high_c) == (21.0, 13.0, 29.0)
    assert (reading.method, reading.prompt_sd_c) == ("text", 0.0)
    assert 0.0 < reading.seconds < ANSWER_S


def test_a_question_with_two_pictures_is_taken(served: str, folder: Path) -> None:
    with pytest.raises(VlmError, match="names 0 materials: `21`"):
        vlm(served, str(folder)).material(PICTURE, PICTURE[:40, :40], ("wood", "glass"))


def test_a_model_that_the_server_does_not_have_is_an_error_in_words(served: str) -> None:
    remote = vlm(served, "no/such-model")
    with pytest.raises(VlmError, match=r"HTTP [45]"):
        remote.ambient(PICTURE)
    with pytest.raises(RestingError):
        remote.ambient(PICTURE)
