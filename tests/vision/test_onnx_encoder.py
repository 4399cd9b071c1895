"""An encoder on onnxruntime: it fits its card or is refused, and never hands out a wrong match."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pace import PACE
from tiny_encoders import Graph, crop, picture, write_onnx

from hapticvlm.vision.encoders.encoder import BATCH, EncoderError
from hapticvlm.vision.encoders.onnx_encoder import OnnxEncoder, load_onnx_encoder
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.pictures import Crop, central_mask

SIDE = 32


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_onnx(tmp_path_factory.mktemp("onnx") / "tiny")


@pytest.fixture(scope="module")
def encoder(folder: Path) -> OnnxEncoder:
    return load_onnx_encoder(folder)


def test_a_folder_with_a_card_is_an_encoder(folder: Path) -> None:
    encoder = load_encoder(str(folder))
    assert (encoder.name, encoder.side, encoder.dimension) == ("tiny-1", SIDE, 128)
    found = encoder.embed([crop(1, SIDE), crop(2, SIDE)])
    assert (found.shape, found.dtype) == ((2, 128), np.float32)  # type: ignore[comparison-overlap]
    assert np.allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-5)


def test_a_batch_gives_what_single_crops_give_however_long(encoder: OnnxEncoder) -> None:
    crops = [crop(seed, SIDE) for seed in range(2 * BATCH + 3)]
    singles = np.concatenate([encoder.embed([one]) for one in crops])
    assert np.allclose(encoder.embed(crops), singles, atol=1e-6)
    assert encoder.embed([]).shape == (0, 128)


def test_the_mask_decides_which_pixels_count(encoder: OnnxEncoder) -> None:
    image, mask = picture(1, SIDE), central_mask(SIDE)
    repainted = np.where(mask[..., None] > 0, image, 255 - image)
    first, same, other = encoder.embed(
        [Crop(image, mask), Crop(repainted, mask), Crop(repainted, 255 - mask)]
    )
    assert np.allclose(first, same, atol=1e-6)
    assert not np.allclose(first, other, atol=1e-2)


def test_a_crop_of_another_side_is_refused_naming_both(encoder: OnnxEncoder) -> None:
    with pytest.raises(EncoderError, match=r"takes crops of 32 px.*\(48, 48, 3\)"):
        encoder.embed([crop(1, SIDE), crop(2, 48)])


@pytest.mark.parametrize(
    ("graph", "reason"),
    [(Graph(is_unit=False), "not of unit norm"), (Graph(gain=float("nan")), "not finite")],
)
def test_an_encoder_without_unit_embeddings_does_not_load(
    tmp_path: Path, graph: Graph, reason: str
) -> None:
    write_onnx(tmp_path, graph)
    with pytest.raises(EncoderError, match=f"`tiny-1`.*{reason}"):
        load_encoder(str(tmp_path))


@pytest.mark.parametrize(
    "graph",
    [
        replace(Graph(), side=48),
        replace(Graph(), dimension=64),
        replace(Graph(), batch=1),
        replace(Graph(), input_name="pixels"),
    ],
)
def test_a_graph_that_does_not_fit_its_card_is_refused(tmp_path: Path, graph: Graph) -> None:
    write_onnx(tmp_path, graph)
    with pytest.raises(EncoderError, match=r"encoder\.onnx has .* encoder\.json needs"):
        load_encoder(str(tmp_path))


def test_another_file_than_the_card_describes_is_refused(tmp_path: Path) -> None:
    write_onnx(tmp_path)
    data = bytearray((tmp_path / "encoder.onnx").read_bytes())
    data[len(data) // 2] ^= 1
    (tmp_path / "encoder.onnx").write_bytes(data)
    with pytest.raises(EncoderError, match=r"encoder.onnx is not the file.*SHA-256.*again"):
        load_encoder(str(tmp_path))
    (tmp_path / "encoder.onnx").unlink()
    with pytest.raises(EncoderError, match=r"encoder.onnx cannot be read.*again"):
        load_encoder(str(tmp_path))


def test_a_file_that_is_not_a_graph_is_refused_in_one_line(tmp_path: Path) -> None:
    from hashlib import sha256

    data = b"no graph at all"
    digest = {"encoder.onnx": sha256(data).hexdigest()}
    write_onnx(tmp_path, sha256=digest)
    (tmp_path / "encoder.onnx").write_bytes(data)
    with pytest.raises(EncoderError, match=r"onnxruntime .* cannot load it") as caught:
        load_encoder(str(tmp_path))
    assert "\n" not in str(caught.value)


def test_a_card_that_is_broken_or_lacks_something_is_refused(tmp_path: Path) -> None:
    card = json.loads((write_onnx(tmp_path) / "encoder.json").read_text())
    wrong: tuple[dict[str, object], ...] = (
        {"name": 3},
        {"side": "32"},
        {"dimension": 0},
        {"sha256": {}},
        {"side": None},
    )
    texts = [json.dumps({**card, **each}) for each in wrong]
    for text in (*texts, "", "[]", "{", json.dumps({"name": "x"})):
        (tmp_path / "encoder.json").write_text(text)
        with pytest.raises(EncoderError, match=r"encoder\.json"):
            load_encoder(str(tmp_path))


def test_it_runs_on_the_cpu_on_threads_that_do_not_spin(folder: Path) -> None:
    session = load_onnx_encoder(folder, threads=1).open()
    options = session.get_session_options()
    assert session.get_providers() == ["CPUExecutionProvider"]
    assert (options.intra_op_num_threads, options.inter_op_num_threads) == (1, 1)
    for pool in ("intra", "inter"):
        assert options.get_session_config_entry(f"session.{pool}_op.allow_spinning") == "0"
    assert load_onnx_encoder(folder, 2).open().get_session_options().intra_op_num_threads == 2


def test_it_imports_no_torch_and_prints_nothing(folder: Path) -> None:
    code = (
        "import sys; from hapticvlm.vision.loading import load_encoder\n"
        "load_encoder(sys.argv[1])\n"
        "assert 'onnxruntime' in sys.modules\n"
        "assert not {'torch', 'transformers', 'huggingface_hub'} & set(sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(folder)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_look_loads_no_masked_arrays_and_keeps_no_file() -> None:
    code = (
        "import sys, hapticvlm, numpy as np\n"
        "from hapticvlm.vision.loading import load_encoder\n"
        "pixels = np.random.default_rng(0).integers(0, 256, (300, 300, 3), np.uint8)\n"
        "hapticvlm.recognise(pixels)\n"
        "assert 'onnxruntime' in sys.modules and 'numpy.ma' not in sys.modules\n"
        "assert load_encoder().open()._model_bytes is None"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60.0 * PACE)
