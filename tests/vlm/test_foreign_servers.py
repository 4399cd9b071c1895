"""Chat servers that others wrote: a mock, and LiteLLM's gateway in front of it.

The mock answers by the name of the model. Behind the gateway's `gone` nothing listens.
"""

import json
from collections.abc import Iterator

import numpy as np
import pytest
from chat_servers import FOREIGN, chat_server
from pace import PACE
from toolchains import require

from hapticvlm.vlm.contract import VlmError, VlmSettings
from hapticvlm.vlm.remote import RemoteVlm

ANSWER_S = 120.0 * PACE
PICTURE = np.random.default_rng(2).integers(0, 255, (120, 160, 3), dtype=np.uint8)
SAYS: dict[str, object] = {
    "thermometer": "**22 °C**",
    "eye": "wood",
    "thinker": {"reasoning": "Snow, so -30 to 60 is too wide.", "text": "-4"},
    "poet": "lovely weather",
}
QUIET = {
    "LITELLM_LOCAL_MODEL_COST_MAP": "True",  # asks nobody for prices
    "DISABLE_ADMIN_UI": "True",
    "LITELLM_DANGEROUSLY_PERMIT_WEAK_OR_UNSET_MASTER_KEY": "true",  # a key needs a database
    "OMP_NUM_THREADS": "1",
}

pytestmark = [pytest.mark.nightly, pytest.mark.slow, pytest.mark.process]


@pytest.fixture(scope="module")
def mock(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The url of a mock that says of each model what SAYS has."""
    require("litellm")
    folder = tmp_path_factory.mktemp("mock")
    rules = [{"when": {"model": name}, "reply": reply} for name, reply in SAYS.items()]
    (folder / "rules.json").write_text(json.dumps({"rules": rules}), encoding="utf-8")
    command = [FOREIGN / "llm-mock-api", "start", "--host", "127.0.0.1", "--rules", "rules.json"]
    with chat_server(command, "/v1/models", folder) as url:
        yield url


@pytest.fixture(scope="module")
def gateway(mock: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The url of LiteLLM with the mock's models behind it, and one that nobody serves."""
    folder = tmp_path_factory.mktemp("gateway")
    bases = {**dict.fromkeys(SAYS, f"{mock}/v1"), "gone": "http://127.0.0.1:9/v1"}
    models = [
        {
            "model_name": name,
            "litellm_params": {"model": f"openai/{name}", "api_base": base, "api_key": "none"},
        }
        for name, base in bases.items()
    ]
    config = {"model_list": models, "litellm_settings": {"telemetry": False, "num_retries": 0}}
    (folder / "config.yaml").write_text(json.dumps(config), encoding="utf-8")  # JSON is YAML
    command = [FOREIGN / "litellm", "--config", "config.yaml", "--host", "127.0.0.1"]
    with chat_server(command, "/health/liveliness", folder, QUIET) as url:
        yield url


@pytest.fixture(params=["mock", "gateway"])
def served(request: pytest.FixtureRequest) -> str:
    url: str = request.getfixturevalue(request.param)
    return url


def vlm(url: str, model: str) -> RemoteVlm:
    return RemoteVlm(VlmSettings(url=url, model=model, timeout_s=ANSWER_S))


def test_a_temperature_is_asked_for_and_read(served: str) -> None:
    reading = vlm(served, "thermometer").ambient(PICTURE)
    assert (reading.value_c, reading.low_c, reading.high_c) == (22.0, 14.0, 30.0)


def test_a_material_is_asked_for_and_read(served: str) -> None:
    evidence = vlm(served, "eye").material(PICTURE, PICTURE[:40, :40], ("wood", "glass"))
    assert max(evidence.beliefs, key=lambda pair: pair[1])[0] == "wood"


def test_a_models_thought_is_not_taken_for_its_answer(served: str) -> None:
    assert vlm(served, "thinker").ambient(PICTURE).value_c == -4.0


def test_a_model_behind_which_nobody_listens_is_an_error_in_the_gateways_words(
    gateway: str,
) -> None:
    with pytest.raises(VlmError, match=r"HTTP 500.*Connection error.*`?gone`?"):
        vlm(gateway, "gone").ambient(PICTURE)
    with pytest.raises(VlmError, match=r"HTTP 400.*model=none-such"):
        vlm(gateway, "none-such").ambient(PICTURE)


def test_a_gateway_with_several_models_lists_them(gateway: str) -> None:
    with pytest.raises(VlmError, match=r"name one: .*thermometer"):
        RemoteVlm(VlmSettings(url=gateway, timeout_s=ANSWER_S)).ambient(PICTURE)
