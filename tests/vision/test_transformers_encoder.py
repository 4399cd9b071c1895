"""Networks of transformers as encoders: real ones, tiny, from folders; and their refusals."""

import json
import shutil
import socket
import sys
from pathlib import Path

import numpy as np
import pytest
from small_hub import small_hub
from tiny_encoders import crop, picture, write_network

from hapticvlm.vision.encoders import joint_embedding
from hapticvlm.vision.encoders.encoder import BATCH, Encoder, EncoderError
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.pictures import Crop

pytestmark = pytest.mark.torch

SIDE = 128  # px; the network sees the middle 112


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_network(tmp_path_factory.mktemp("networks") / "tiny")


@pytest.fixture(scope="module")
def encoder(folder: Path) -> Encoder:
    return load_encoder(str(folder))


def copy(folder: Path, to: Path, **processor: object) -> Path:
    """The same network with other words in its preprocessing file."""
    shutil.copytree(folder, to)
    path = to / "preprocessor_config.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **processor}))
    return to


def test_a_saved_network_is_an_encoder(encoder: Encoder) -> None:
    assert (encoder.side, encoder.dimension) == (SIDE, 32)
    found = encoder.embed([crop(seed, SIDE) for seed in range(3)])
    assert (found.shape, found.dtype) == ((3, 32), np.float32)  # type: ignore[comparison-overlap]
    assert np.allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-5)
    assert encoder.embed([]).shape == (0, 32)


def test_a_batch_gives_what_single_crops_give(encoder: Encoder) -> None:
    crops = [crop(seed, SIDE) for seed in range(BATCH + 3)]
    singles = np.concatenate([encoder.embed([one]) for one in crops])
    assert np.allclose(encoder.embed(crops), singles, atol=1e-5)


def test_its_name_depends_on_its_weights(folder: Path, encoder: Encoder, tmp_path: Path) -> None:
    assert encoder.name.startswith("tiny-")
    assert encoder.name.endswith(" (transformers)")
    assert load_encoder(str(copy(folder, tmp_path / "tiny"))).name == encoder.name
    other = write_network(tmp_path / "other" / "tiny", seed=5)
    assert load_encoder(str(other)).name != encoder.name


def test_with_a_full_mask_it_pools_as_the_network_itself_does(folder: Path) -> None:
    import torch
    from transformers import AutoImageProcessor, AutoModel

    image = picture(1, SIDE)
    given = AutoImageProcessor.from_pretrained(folder)(image, return_tensors="pt")
    with torch.inference_mode():
        pooled = AutoModel.from_pretrained(folder).eval()(**given).pooler_output[0].numpy()
    full = Crop(image, np.full((SIDE, SIDE), 255, np.uint8))
    ours = load_encoder(str(folder)).embed([full])[0]
    assert np.allclose(ours, pooled / np.linalg.norm(pooled), atol=1e-5)


def test_tokens_without_a_place_are_left_out(tmp_path: Path) -> None:
    import torch
    from transformers import AutoImageProcessor, AutoModel

    saved, image = write_network(tmp_path / "ViT", "ViT"), picture(1, SIDE)
    given = AutoImageProcessor.from_pretrained(saved)(image, return_tensors="pt")
    with torch.inference_mode():
        tokens = AutoModel.from_pretrained(saved).eval()(**given).last_hidden_state[0].numpy()
    mean = tokens[1:].mean(axis=0)
    full = Crop(image, np.full((SIDE, SIDE), 255, np.uint8))
    ours = load_encoder(str(saved)).embed([full])[0]
    assert np.allclose(ours, mean / np.linalg.norm(mean), atol=1e-5)


@pytest.mark.parametrize("kind", ["ConvNext", "ConvNextV2", "DINOv3ConvNext", "ResNet", "ViT"])
def test_the_mask_changes_the_answer_of_every_kind_of_network(tmp_path: Path, kind: str) -> None:
    encoder = load_encoder(str(write_network(tmp_path / kind, kind)))
    image, left = picture(1, SIDE), np.zeros((SIDE, SIDE), np.uint8)
    left[:, : SIDE // 2] = 255
    masks = [left, 255 - left, np.full_like(left, 255), np.zeros_like(left)]
    one, other, full, empty = encoder.embed([Crop(image, mask) for mask in masks])
    assert np.abs(one - other).max() > 1e-4
    assert np.allclose(full, empty, atol=1e-6)


@pytest.mark.parametrize(
    "kind", ["ConvNextForImageClassification", "MobileNetV2ForImageClassification"]
)
def test_a_classifier_adds_what_its_classes_are_made_of(tmp_path: Path, kind: str) -> None:
    import torch
    from transformers import AutoModelForImageClassification

    saved = write_network(tmp_path / kind, kind, crop_pct=1.0)
    encoder, shown = load_encoder(str(saved)), crop(1, 112)
    model = AutoModelForImageClassification.from_pretrained(saved).eval()
    levels = (shown.image / 255.0 - [0.485, 0.456, 0.406]) / [0.229, 0.224, 0.225]
    pixels = torch.from_numpy(levels.transpose(2, 0, 1)[None].astype(np.float32))
    with torch.inference_mode():
        scores = model(pixel_values=pixels).logits.numpy()
    found = joint_embedding.log_beliefs(encoder.embed([shown]))
    expected = np.log(joint_embedding.material_beliefs(scores) + joint_embedding.FLOOR)
    assert encoder.name.endswith("(transformers, classes)")
    assert np.allclose(found, expected, atol=0.05)


@pytest.mark.parametrize("kind", ["CLIP", "Siglip"])
def test_of_a_network_of_pictures_and_text_the_half_that_sees_is_used(
    tmp_path: Path, kind: str
) -> None:
    encoder = load_encoder(str(write_network(tmp_path / kind, kind, crop_pct=1.0)))
    assert encoder.name.endswith("(transformers)")
    assert encoder.dimension == 16
    first, second = encoder.embed([crop(1, 112), crop(2, 112)])
    assert np.abs(first - second).max() > 1e-5


def test_pickled_weights_are_refused(folder: Path, tmp_path: Path) -> None:
    pickled = copy(folder, tmp_path / "pickled")
    (pickled / "model.safetensors").rename(pickled / "pytorch_model.bin")
    with pytest.raises(EncoderError, match=r"pickled weights \(pytorch_model\.bin\).*safetensors"):
        load_encoder(str(pickled))


def test_brightness_is_normalised_as_the_networks_own_file_states(
    folder: Path, encoder: Encoder, tmp_path: Path
) -> None:
    shifted = [level + 20 / 255 for level in (0.485, 0.456, 0.406)]
    brighter = load_encoder(str(copy(folder, tmp_path / "tiny", image_mean=shifted)))
    dark = crop(1, SIDE)
    image = (dark.image // 2).astype(np.uint8)
    first = encoder.embed([Crop(image, dark.mask)])
    again = brighter.embed([Crop(image + 20, dark.mask)])
    assert np.allclose(first, again, atol=1e-5)
    assert not np.allclose(first, encoder.embed([Crop(image + 20, dark.mask)]), atol=1e-3)


def test_a_folder_never_asks_the_network(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from huggingface_hub import constants

    asked: list[object] = []
    monkeypatch.setattr(constants, "HF_HUB_OFFLINE", False)
    monkeypatch.setattr(socket, "getaddrinfo", lambda *where, **_: asked.append(where))
    monkeypatch.setattr(socket.socket, "connect", lambda _, where: asked.append(where))
    load_encoder(str(folder))
    assert not asked
    with pytest.raises(EncoderError, match="cannot be downloaded"):
        load_encoder("nobody/nothing")
    assert asked


def test_a_name_in_this_machines_cache_needs_no_connection(
    folder: Path, encoder: Encoder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from huggingface_hub import constants

    commit = "0123456789abcdef0123456789abcdef01234567"
    repository = tmp_path / "models--me--tiny"
    shutil.copytree(folder, repository / "snapshots" / commit)
    (repository / "refs").mkdir()
    (repository / "refs" / "main").write_text(commit)
    monkeypatch.setattr(constants, "HF_HUB_CACHE", str(tmp_path))
    monkeypatch.setattr(constants, "HF_HUB_OFFLINE", True)
    cached = load_encoder("me/tiny")
    assert cached.name == "me/tiny (transformers)"
    seen = [crop(1, SIDE)]
    assert np.allclose(cached.embed(seen), encoder.embed(seen), atol=1e-6)


def test_a_network_of_the_hub_is_downloaded_once_and_without_its_other_copies(
    folder: Path, encoder: Encoder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import huggingface_hub
    from huggingface_hub import constants

    monkeypatch.setattr(constants, "HF_HUB_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(constants, "HF_HUB_OFFLINE", False)
    stored = shutil.copytree(folder, tmp_path / "stored")
    for other in ("model.fp16.safetensors", "pytorch_model.bin", "tf_model.h5", "README.md"):
        (stored / other).write_text(other)
    with small_hub("me/tiny", stored) as (address, sent):
        api = huggingface_hub.HfApi(endpoint=address)
        monkeypatch.setattr(huggingface_hub, "model_info", api.model_info)
        monkeypatch.setattr(huggingface_hub, "snapshot_download", api.snapshot_download)
        network = load_encoder("me/tiny")
        assert sorted(sent) == sorted(each.name for each in folder.iterdir())
        load_encoder("me/tiny")
        assert len(sent) == len({*sent})
    seen = [crop(1, SIDE)]
    assert np.allclose(network.embed(seen), encoder.embed(seen), atol=1e-6)


def test_a_gpu_is_refused_where_there_is_none(folder: Path) -> None:
    import torch

    if torch.cuda.is_available():
        assert np.isfinite(load_encoder(str(folder), device="cuda").embed([crop(1, SIDE)])).all()
        return
    with pytest.raises(EncoderError, match="no CUDA device here; use cpu"):
        load_encoder(str(folder), device="cuda")
    assert load_encoder(str(folder), device="auto").embed([crop(1, SIDE)]).shape == (1, 32)


def test_without_the_extra_the_error_names_the_packages(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for missing in ("torch", "transformers.utils"):
        with monkeypatch.context() as patch:
            patch.setitem(sys.modules, missing, None)
            with pytest.raises(EncoderError, match="pip install torch transformers safetensors"):
                load_encoder(str(folder))


SPOILT = {
    "preprocessor_config.json is missing": ("preprocessor_config.json", None),
    "cannot be loaded": ("model.safetensors", None),
    "lacks .* weights": ("config.json", {"depths": [1, 1, 3, 1]}),
    "cannot be loaded|lacks .* weights": ("config.json", {"hidden_sizes": [8, 16, 24, 48]}),
    "do_flip_channel_order": ("preprocessor_config.json", {"do_flip_channel_order": True}),
}


@pytest.mark.parametrize("complaint", SPOILT)
def test_a_spoilt_folder_is_refused_in_one_line(
    folder: Path, tmp_path: Path, complaint: str
) -> None:
    name, more = SPOILT[complaint]
    file = Path(shutil.copytree(folder, tmp_path / "spoilt")) / name
    if more is None:
        file.unlink()
    else:
        file.write_text(json.dumps({**json.loads(file.read_text()), **more}))
    with pytest.raises(EncoderError, match=complaint) as caught:
        load_encoder(str(tmp_path / "spoilt"))
    assert "\n" not in str(caught.value)
    assert "spoilt" in str(caught.value)


def test_a_network_without_pictures_is_refused(tmp_path: Path) -> None:
    with pytest.raises(EncoderError, match="is a BertModel"):
        load_encoder(str(write_network(tmp_path / "text", "Bert")))


def test_code_that_comes_with_a_network_is_never_run(folder: Path, tmp_path: Path) -> None:
    theirs = copy(folder, tmp_path / "theirs")
    config = {"model_type": "theirs", "auto_map": {"AutoConfig": "own.C", "AutoModel": "own.M"}}
    (theirs / "config.json").write_text(json.dumps(config))
    ran = tmp_path / "ran"
    (theirs / "own.py").write_text(f"open({str(ran)!r}, 'w')\nclass C: pass\nclass M: pass\n")
    with pytest.raises(EncoderError, match="its own code"):
        load_encoder(str(theirs))
    assert not ran.exists()
