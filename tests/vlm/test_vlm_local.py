"""A vision-language model in process, on a tiny Qwen2-VL of the real architecture."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tiny_encoders import write_network
from tiny_vlm import picture, planting, rewrite, write_tiny_vlm

from hapticvlm import materials
from hapticvlm.evidence.ladder import SURE, decide
from hapticvlm.server.settings import ServeOptions
from hapticvlm.vision.encoders.networks import PASSIVE
from hapticvlm.vlm import contract, weights
from hapticvlm.vlm.contract import VlmError, VlmSettings
from hapticvlm.vlm.limits import TRUST
from hapticvlm.vlm.local import LocalVlm, load_local
from hapticvlm.vlm.numbers import CANDIDATES_C, number_beliefs
from hapticvlm.vlm.weights import Precision

if TYPE_CHECKING:
    import torch

pytestmark = pytest.mark.torch

NAMES = tuple(materials.MATERIALS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tiny_vlm(tmp_path_factory.mktemp("vlm") / "tiny")


@pytest.fixture(scope="module")
def vlm(folder: Path) -> LocalVlm:
    return load(folder)


@pytest.fixture
def copied(folder: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(folder, tmp_path / "copy"))


def settings(folder: Path, **options: Any) -> VlmSettings:
    return VlmSettings(**{"model": str(folder), **options})


def load(folder: Path, precision: Precision = "float32", **options: Any) -> LocalVlm:
    return load_local(settings(folder, **options), precision)


def brute_force(vlm: LocalVlm, question: int) -> NDArray[np.float64]:
    """Score every candidate string by itself: a pass a token, nothing packed, nothing kept."""
    asked = contract.about_ambient()
    one = replace(asked, questions=(asked.questions[question],))
    prompt = vlm.chat.prompt(one, [picture()])
    texts = [tuple(vlm.chat.encode(str(number))) for number in range(-99, 200)]
    wanted = [tuple(vlm.chat.encode(str(number))) for number in CANDIDATES_C.tolist()]
    known: dict[tuple[int, ...], NDArray[np.float64]] = {}

    def following(text: tuple[int, ...]) -> NDArray[np.float64]:
        if text not in known:
            known[text] = np.exp(vlm.network.following(prompt, text).astype(np.float64))
        return known[text]

    found = []
    for text in wanted:
        score = 1.0
        for place, token in enumerate(text):
            score *= following(text[:place])[token]
        longer = {other[len(text)] for other in texts if other[: len(text)] == text != other}
        found.append(score * (1.0 - following(text)[sorted(longer)].sum() if longer else 1.0))
    return np.array(found)


def test_the_readout_is_what_scoring_every_candidate_string_gives(vlm: LocalVlm) -> None:
    prompt = vlm.chat.prompt(contract.about_ambient(), [picture()])
    read = [number_beliefs(vlm.numbers, one) for one in vlm.network.readout(prompt, vlm.numbers)]
    for question in range(2):
        scored = brute_force(vlm, question)
        assert np.abs(read[question] - scored).max() < 1e-4
        normal, wanted = read[question] / read[question].sum(), scored / scored.sum()
        assert np.abs(normal - wanted).max() < 1e-4
        assert wanted.max() > 0.02  # the comparison is one of more than rounding


def test_a_cached_head_changes_nothing(vlm: LocalVlm) -> None:
    prompt = vlm.chat.prompt(contract.about_ambient(), [picture()])
    keeping = vlm.network.readout(prompt, vlm.numbers)
    again = vlm.network.readout(prompt, vlm.numbers)
    whole = replace(prompt, head=(), body=(*prompt.head, *prompt.body))  # nothing to keep
    forgetful = vlm.network.readout(whole, vlm.numbers)
    assert np.abs(np.exp(keeping) - np.exp(forgetful)).max() < 1e-5
    assert (keeping == again).all()


def test_the_answer_hangs_on_picture_and_wording(vlm: LocalVlm) -> None:
    rows = []
    for seed in range(2):
        prompt = vlm.chat.prompt(contract.about_ambient(), [picture(seed)])
        rows.append(np.exp(vlm.network.readout(prompt, vlm.numbers)[:, 0]))
    assert np.abs(rows[0] - rows[1]).max() > 1e-3
    assert np.abs(rows[0][0] - rows[0][1]).max() > 1e-3


def test_a_plain_pass_is_the_librarys_own(vlm: LocalVlm) -> None:
    import torch

    prompt = vlm.chat.prompt(contract.about_ambient(), [picture()])
    ids = torch.tensor([[*prompt.head, *prompt.body, *prompt.tails[0]]])
    kinds = (ids == vlm.network.model.config.image_token_id).int()
    with torch.inference_mode():
        logits = vlm.network.model(
            input_ids=ids, mm_token_type_ids=kinds, logits_to_keep=1, **prompt.tensors
        ).logits
    wanted = torch.log_softmax(logits[0, -1].float(), dim=-1).numpy()
    assert np.abs(vlm.network.following(prompt) - wanted).max() < 1e-4


def test_planted_logits_are_read_as_the_number_they_spell(vlm: LocalVlm) -> None:
    with planting(vlm, "-17"):
        reading = vlm.ambient(picture())
    assert reading.value_c == pytest.approx(-17.0, abs=1e-3)
    assert reading.low_c == pytest.approx(-25.0, abs=1e-2)
    assert reading.high_c == pytest.approx(-9.0, abs=1e-2)
    assert reading.prompt_sd_c == pytest.approx(0.0, abs=1e-3)
    assert reading.share == pytest.approx(1.0, abs=1e-3)
    assert reading.method == "readout"


def test_a_reading_has_interval_deviation_and_share(vlm: LocalVlm) -> None:
    with planting(vlm, "21", "24", share=0.7):
        reading = vlm.ambient(picture())
    assert reading.value_c == pytest.approx(22.5, abs=1e-3)
    assert (reading.low_c, reading.high_c) == pytest.approx((14.5, 30.5), abs=1e-3)
    assert reading.prompt_sd_c == pytest.approx(np.std([21, 24], ddof=1), abs=1e-3)
    assert reading.share == pytest.approx(0.7, abs=1e-3)
    assert reading.seconds > 0.0


def test_bfloat16_gives_nearly_the_same(folder: Path, vlm: LocalVlm) -> None:
    import torch

    half = load(folder, "bfloat16")
    assert half.network.model.dtype == torch.bfloat16
    assert torch.get_num_threads() == 1  # the other cores are the gateway's
    assert abs(expected_c(half) - expected_c(vlm)) < 3.0


def expected_c(vlm: LocalVlm) -> float:
    """The expectation over what a network believes of numbers, however little that is."""
    prompt = vlm.chat.prompt(contract.about_ambient(), [picture()])
    row = number_beliefs(vlm.numbers, vlm.network.readout(prompt, vlm.numbers)[0])
    return float(row @ CANDIDATES_C / row.sum())


@pytest.mark.parametrize("budget", [4, 16, 256])
def test_a_picture_costs_no_more_tokens_than_allowed(folder: Path, budget: int) -> None:
    vlm = load(folder, image_tokens=budget)
    for shape in ((480, 640), (90, 300), (1, 1), (30, 20)):
        small = np.zeros((*shape, 3), np.uint8)
        prompt = vlm.chat.prompt(contract.about_ambient(), [small])
        assert 1 <= prompt.body.count(vlm.chat.image_id) <= budget


def test_by_default_a_picture_may_have_what_the_makers_of_the_model_advise() -> None:
    assert VlmSettings().image_tokens == ServeOptions().image_tokens == 256
    assert VlmSettings().timeout_s == ServeOptions().vlm_timeout


def test_a_material_is_evidence_that_leaves_the_rest_open(vlm: LocalVlm) -> None:
    evidence = vlm.material(picture(), picture(1, 60, 60), NAMES)
    assert evidence.rung == "vlm"
    assert {name for name, _ in evidence.beliefs} == set(NAMES)
    chances = [chance for _, chance in evidence.beliefs]
    assert chances == sorted(chances, reverse=True)
    assert 0.0 < sum(chances) <= TRUST


@pytest.mark.parametrize("name", ["wood", "ceramic", "foliage"])
def test_a_planted_material_is_believed_but_never_for_sure(vlm: LocalVlm, name: str) -> None:
    with planting(vlm, name):
        evidence = vlm.material(picture(), picture(1, 60, 60), NAMES)
    assert evidence.material == name
    assert evidence.confidence == pytest.approx(TRUST, abs=1e-3)
    assert evidence.confidence < SURE
    assert decide([evidence]).source == "vlm"


def test_a_model_that_answers_unknown_has_no_beliefs(vlm: LocalVlm) -> None:
    with planting(vlm, materials.UNKNOWN):
        evidence = vlm.material(picture(), picture(1, 60, 60), NAMES)
    assert sum(chance for _, chance in evidence.beliefs) < 1e-3


def half_weights(folder: Path) -> None:
    file = folder / "model.safetensors"
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def few_weights(folder: Path) -> None:
    rewrite(folder, lambda name, it: None if "layers.1.mlp" in name else it)


def nan_weights(folder: Path) -> None:
    rewrite(folder, lambda name, it: it * np.nan if name.endswith("norm.weight") else it)


def text_model(folder: Path) -> None:
    told = json.loads((folder / "config.json").read_text())["text_config"]
    (folder / "config.json").write_text(json.dumps({**told, "model_type": "qwen2"}))


# A file and its new content, further fields of its JSON, None where it is gone, or what spoils it.
WEIGHTS, CONFIG, TEMPLATE = "model.safetensors", "config.json", "chat_template.jinja"
SHARDS = json.dumps({"weight_map": {"a": "model-00001-of-00002.safetensors"}})
FP8 = {"quantization_config": {"quant_method": "fp8"}}
SPOILT: list[tuple[str, Any, str]] = [
    (WEIGHTS, nan_weights, "NaN or infinite logits"),
    (WEIGHTS, few_weights, r"lacks \d weights"),
    (WEIGHTS, half_weights, r"model.safetensors is cut, \d+ of \d+ bytes"),
    (WEIGHTS, "version https://git-lfs.github.com/spec/v1\noid 0\n", "git lfs pull"),
    (WEIGHTS, None, "cannot be loaded|failed"),
    (f"{WEIGHTS}.index.json", SHARDS, "model-00001-of-00002.safetensors is missing"),
    (CONFIG, {"model_type": "new_vlm"}, "does not know its type `new_vlm`: pip install -U"),
    (CONFIG, FP8, "fp8"),
    (CONFIG, "{", "cannot be loaded|failed"),
    (CONFIG, None, "has no config.json"),
    (CONFIG, text_model, "cannot be loaded|failed"),
    ("tokenizer*", None, "tokenizer.json is missing"),
    (TEMPLATE, None, "chat.template"),
    (TEMPLATE, "{% for m in messages %}hello{% endfor %}", "does not take pictures"),
]


@pytest.mark.parametrize(("name", "spoil", "complaint"), SPOILT)
def test_a_spoilt_folder_is_refused(copied: Path, name: str, spoil: Any, complaint: str) -> None:
    if callable(spoil):
        spoil(copied)
    elif spoil is None:
        for file in copied.glob(name):
            file.unlink()
    elif isinstance(spoil, str):
        (copied / name).write_text(spoil)
    else:
        told = json.loads((copied / name).read_text())
        (copied / name).write_text(json.dumps({**told, **spoil}))
    with pytest.raises(VlmError, match=complaint):
        load(copied)


def test_an_encoder_is_not_a_vision_language_model(tmp_path: Path) -> None:
    with pytest.raises(VlmError, match=r"cannot be loaded|failed"):
        load(write_network(tmp_path / "convnext"))


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"device": "tpu"}, "`tpu`.*cpu or cuda"),
        ({"threads": 0}, "0 threads.*1 or more"),
        ({"image_tokens": 3}, "3 image tokens.*needs 4"),
        ({"model": "no/such/folder"}, "is not a folder"),
        ({"model": ""}, "is not a folder|has no config"),
    ],
)
def test_settings_that_do_not_fit_are_refused(
    folder: Path, options: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(VlmError, match=complaint):
        load(folder, **options)


def test_a_model_larger_than_the_free_memory_is_refused(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = tmp_path / "meminfo"
    told.write_text("MemTotal: 100 kB\nMemAvailable: 90 kB\n")
    monkeypatch.setattr(weights, "MEMINFO", told)
    with pytest.raises(VlmError, match="out of memory"):
        load(folder)


def test_memory_that_cannot_be_asked_for_is_said_before_a_model_is_loaded(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    for path in ("MEMINFO", "CPUINFO"):  # as on macOS and Windows
        monkeypatch.setattr(weights, path, Path("/nowhere"))
    load_local(settings(folder), None)
    assert "cannot be asked" in caplog.text


def of_a_gpu() -> Exception:
    import torch

    return torch.OutOfMemoryError("CUDA out of memory")


@pytest.mark.parametrize(
    "error",
    [
        lambda: MemoryError("no more"),
        of_a_gpu,
        lambda: RuntimeError("DefaultCPUAllocator: can't allocate memory: you tried to allocate 9"),
    ],
    ids=["python", "gpu", "processor"],
)
def test_lack_of_memory_during_a_question_is_reported(
    vlm: LocalVlm, error: Callable[[], Exception]
) -> None:
    def fail(*_: object) -> None:
        raise error()

    hook = vlm.network.model.lm_head.register_forward_pre_hook(fail)
    try:
        with pytest.raises(VlmError, match="ran out of memory"):
            vlm.ambient(picture())
    finally:
        hook.remove()
    assert vlm.material(picture(), picture(), NAMES).rung == "vlm"


@pytest.mark.parametrize("wrong", [float("nan"), float("inf")])
def test_logits_that_are_not_numbers_are_reported(vlm: LocalVlm, wrong: float) -> None:
    def spoil(_module: object, _inputs: object, logits: torch.Tensor) -> torch.Tensor:
        logits = logits.clone()
        logits[0, -1, 5] = wrong
        return logits

    hook = vlm.network.model.lm_head.register_forward_hook(spoil)
    try:
        for ask in (
            lambda: vlm.ambient(picture()),
            lambda: vlm.material(picture(), picture(), NAMES),
        ):
            with pytest.raises(VlmError, match="NaN or infinite"):
                ask()
    finally:
        hook.remove()


def test_an_array_that_is_not_a_picture_is_refused(vlm: LocalVlm) -> None:
    for shape in ((0, 0, 3), (3, 2000, 3)):
        with pytest.raises(VlmError, match="image processor fails"):
            vlm.ambient(np.zeros(shape, np.uint8))


def test_heads_are_kept_for_a_few_instructions_only(vlm: LocalVlm) -> None:
    for count in range(2, 9):
        vlm.material(picture(), picture(1), NAMES[:count])
    assert len(vlm.network._heads) == 4


@pytest.mark.nightly
def test_a_process_is_prepared_before_torch_is_imported(folder: Path) -> None:
    code = (
        "import os, sys\n"
        "from hapticvlm.vlm.local import load_vlm\n"
        "from hapticvlm.vlm.contract import VlmSettings\n"
        "assert 'torch' not in sys.modules\n"
        "load_vlm(VlmSettings(model=sys.argv[1]))\n"
        f"assert all(os.environ[k] == v for k, v in {PASSIVE!r}.items())\n"
    )
    clean = {key: value for key, value in os.environ.items() if key not in PASSIVE}
    root = Path(contract.__file__).parents[2]
    subprocess.run(
        [sys.executable, "-c", code, str(folder)],
        check=True,
        env={**clean, "PYTHONPATH": str(root)},
        timeout=300,
    )


def test_a_folder_that_is_not_there_is_refused_before_torch_is_imported(tmp_path: Path) -> None:
    code = (
        "import sys\n"
        "from hapticvlm.vlm.contract import VlmError, VlmSettings\n"
        "from hapticvlm.vlm.local import load_vlm\n"
        "try:\n"
        "    load_vlm(VlmSettings(model=sys.argv[1]))\n"
        "except VlmError as error:\n"
        "    print(error, 'torch' in sys.modules)\n"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "nothing")]
    said = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout
    assert "is not a folder" in said
    assert said.split()[-1] == "False"
