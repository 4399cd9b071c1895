"""The remote model against a real `transformers serve`, a process of its own on loopback.

It serves a tiny LLaVA with a planted answer, not a Qwen2-VL, whose processor needs torchvision.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from chat_servers import chat_server
from in_process import hapticvlm
from pace import PACE
from PIL import Image
from tiny_llava import write_llava
from toolchains import require

from hapticvlm.vlm.contract import VlmError, VlmSettings
from hapticvlm.vlm.remote import RemoteVlm, RestingError

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
    program = [sys.executable, "-c", "from transformers.cli.transformers import main; main()"]
    quiet = {"HF_HOME": str(home), "HF_HUB_OFFLINE": "1", "OMP_NUM_THREADS": "1"}
    command = [*program, "serve", folder, "--device", "cpu"]
    with chat_server(command, "/health", home, quiet) as url:
        yield url


def vlm(url: str, model: str) -> RemoteVlm:
    return RemoteVlm(VlmSettings(url=url, model=model, timeout_s=ANSWER_S))


def test_a_served_model_is_asked_and_read(served: str, folder: Path) -> None:
    reading = vlm(served, str(folder)).ambient(PICTURE)
    assert (reading.value_c, reading.low_c, reading.high_c) == (21.0, 13.0, 29.0)
    assert (reading.method, reading.prompt_sd_c) == ("text", 0.0)
    assert 0.0 < reading.seconds < ANSWER_S


def test_a_question_with_two_pictures_is_taken(served: str, folder: Path) -> None:
    with pytest.raises(VlmError, match="names no material or several: `21`"):
        vlm(served, str(folder)).material(PICTURE, PICTURE[:40, :40], ("wood", "glass"))


def test_an_evaluation_asks_the_server_and_says_why_another_model_does_not_answer(
    served: str, folder: Path, tmp_path: Path
) -> None:
    Image.fromarray(PICTURE).save(tmp_path / "a.png")
    file = tmp_path / "truth.csv"
    file.write_text("image,temperature_c\na.png,20\n", encoding="utf-8")
    graded, failed = (
        hapticvlm("evaluate", "ambient", file, "--vlm-url", served, "--vlm", model)
        for model in (str(folder), "no/such-model")
    )
    assert graded.code == 0
    assert failed.code == 1
    assert "1 of 1 not answered, the last: the endpoint answers HTTP 4" in failed.out


def test_a_model_that_the_server_does_not_have_is_an_error_in_words(served: str) -> None:
    remote = vlm(served, "no/such-model")
    with pytest.raises(VlmError, match=r"HTTP [45]"):
        remote.ambient(PICTURE)
    with pytest.raises(RestingError):
        remote.ambient(PICTURE)
