"""Image networks in one file: tiny ONNX graphs run by onnxruntime; and their refusals."""

import io
import json
import re
import sys
import threading
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiny_encoders import crop, picture, write_classifier, write_graph

from hapticvlm import materials
from hapticvlm.vision.encoders import joint_embedding
from hapticvlm.vision.encoders.encoder import BATCH, EncoderError, NetworkEncoder
from hapticvlm.vision.encoders.file_encoder import load_file_encoder
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.pictures import Crop

SIDE = 32


def masked(*, left: bool) -> Crop:
    mask = np.zeros((SIDE, SIDE), np.uint8)
    mask[:, : SIDE // 2] = 255
    return Crop(picture(1, SIDE), mask if left else 255 - mask)


def _cores(status: Path) -> str:
    lines = status.read_text(encoding="ascii").splitlines()
    return next(line for line in lines if line.startswith("Cpus_allowed_list"))


def test_a_classifier_in_a_file_is_an_encoder(tmp_path: Path) -> None:
    encoder = load_file_encoder(write_classifier(tmp_path / "tiny.onnx"))
    assert (encoder.side, encoder.dimension) == (SIDE, 8 + joint_embedding.ADDED)
    crops = [crop(seed, SIDE) for seed in range(BATCH + 2)]
    found = encoder.embed(crops)
    assert np.allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-5)
    singles = np.concatenate([encoder.embed([single]) for single in crops])
    assert np.allclose(found, singles, atol=1e-5)


def test_its_class_scores_are_read_as_materials(tmp_path: Path) -> None:
    import onnxruntime

    path = write_classifier(tmp_path / "tiny.onnx")
    shown = Crop(picture(2, SIDE), np.full((SIDE, SIDE), 255, np.uint8))
    levels = shown.image.astype(np.float32) / 255.0
    mean, deviation = np.array([[0.485, 0.456, 0.406], [0.229, 0.224, 0.225]], np.float32)
    normalised = (levels - mean) / deviation
    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    shares = session.run(None, {"pixels": normalised.transpose(2, 0, 1)[None]})[0]
    expected = shares[0] @ joint_embedding.material_weights()
    found = np.exp(joint_embedding.log_beliefs(load_file_encoder(path).embed([shown])))[0]
    assert np.allclose(found[:-1] - joint_embedding.FLOOR, expected, atol=2e-3)


def test_the_mask_decides_what_the_features_show(tmp_path: Path) -> None:
    encoder = load_file_encoder(write_classifier(tmp_path / "tiny.onnx"))
    left, right = joint_embedding.features_of(
        encoder.embed([masked(left=True), masked(left=False)])
    )
    assert np.abs(left - right).max() > 1e-3


def test_a_background_class_before_the_thousand_is_left_out(tmp_path: Path) -> None:
    scores = np.random.default_rng(1).normal(size=(3, 1001)).astype(np.float32)
    found = joint_embedding.material_beliefs(scores)
    assert np.allclose(found, joint_embedding.material_beliefs(scores[:, 1:]))
    assert np.allclose(found.sum(axis=1), 1.0, atol=1e-6)
    path = write_classifier(tmp_path / "tiny.onnx", classes=1001)
    assert load_file_encoder(path).dimension == 8 + joint_embedding.ADDED


def test_a_network_of_other_classes_gives_its_features_alone(tmp_path: Path) -> None:
    encoder = load_file_encoder(write_classifier(tmp_path / "tiny.onnx", classes=12))
    assert isinstance(encoder, NetworkEncoder)
    assert (encoder.dimension, encoder.beliefs) == (8, False)


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc, which only Linux has")
def test_embedding_leaves_the_process_free_to_run_on_every_core(tmp_path: Path) -> None:
    encoder = load_file_encoder(write_classifier(tmp_path / "tiny.onnx"))
    status = Path(f"/proc/self/task/{threading.get_native_id()}/status")
    free, seen, looked = _cores(status), set[str](), threading.Event()

    def watch() -> None:
        while not looked.is_set():
            seen.add(_cores(status))

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    for _ in range(50):
        encoder.embed([crop(1, SIDE)])
    looked.set()
    watcher.join()
    assert seen == {free}


def test_its_name_depends_on_its_weights(tmp_path: Path) -> None:
    first = load_file_encoder(write_classifier(tmp_path / "a.onnx"))
    (tmp_path / "other").mkdir()
    other = load_file_encoder(write_classifier(tmp_path / "other" / "a.onnx", seed=2))
    assert first.name != other.name
    assert first.name.startswith("a-")


def test_the_preprocessing_file_beside_it_counts(tmp_path: Path) -> None:
    path = write_classifier(tmp_path / "tiny.onnx")
    assumed = load_file_encoder(path).embed([crop(1, SIDE)])
    given = {"size": SIDE, "image_mean": [0.5] * 3, "image_std": [0.5] * 3}
    (tmp_path / "preprocessor_config.json").write_text(json.dumps(given))
    assert np.abs(load_file_encoder(path).embed([crop(1, SIDE)]) - assumed).max() > 1e-3
    (tmp_path / "preprocessor_config.json").write_text(json.dumps({**given, "size": 64}))
    with pytest.raises(EncoderError, match="takes 32 px, preprocessor_config"):
        load_file_encoder(path)


def test_a_file_that_is_not_a_network_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(EncoderError, match="no such file"):
        load_encoder(str(tmp_path / "absent.onnx"))
    whole = write_classifier(tmp_path / "whole.onnx").read_bytes()
    xml = '\n <?xml version="1.0"?><net name="x" version="11"/>'.encode("utf-16")
    for data in (b"", b"no network at all" * 9, whole[:-9], whole[: len(whole) // 2], xml):
        (tmp_path / "broken.onnx").write_bytes(data)
        with pytest.raises(EncoderError, match=r"broken\.onnx` cannot be read") as caught:
            load_encoder(str(tmp_path / "broken.onnx"))
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("classes", [3, 1000])  # features alone, and beliefs beside them
@pytest.mark.parametrize(
    ("gain", "reason"),
    [
        (float("nan"), "not finite for a picture: its weights are damaged"),
        (float("inf"), "not finite for a picture: its weights are damaged"),
        (0.0, "the same features for plain grey and for stripes"),
    ],
)
def test_a_network_that_sees_nothing_is_refused(
    tmp_path: Path, gain: float, reason: str, classes: int
) -> None:
    path = write_classifier(tmp_path / "blind.onnx", classes, gain=gain)
    with pytest.raises(EncoderError, match=reason) as caught:
        load_encoder(str(path))
    assert "name" in str(caught.value)
    assert "network" in str(caught.value)


def zipped(*names: str) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name in names:
            archive.writestr(name, b"content")
    return out.getvalue()


FOREIGN = {
    "lfs.onnx": (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git lfs pull"),
    "page.onnx": (b"<!DOCTYPE html><html>", "download the file itself"),
    "torch.pt": (zipped("net/data.pkl", "net/data/0"), "torch.onnx.export"),
    "old.pth": (b"\x80\x02\x8a\nl\xfc\x9cF\xf9", "torch.onnx.export"),
    "pretending.onnx": (zipped("net/data.pkl", "net/data/0"), "torch.onnx.export"),
    "keras.h5": (b"\x89HDF\r\n\x1a\n" + bytes(50), "tf2onnx"),
    "new.keras": (zipped("metadata.json", "config.json"), "tf2onnx"),
    "lite.tflite": (b"\x1c\0\0\0TFL3", "tf2onnx"),
    "hand.task": (zipped("hand_detector.tflite"), "tf2onnx"),
    "llava.gguf": (b"GGUF\x03\0\0\0", "--vlm-url"),
    "some.safetensors": (
        b"\x40\0\0\0\0\0\0\0" + b'{"w":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}}',
        "preprocessor_config.json",
    ),
    "model.json": (b'{"format": "graph-model", "modelTopology": {}}', "tensorflowjs_converter"),
    "all.zip": (zipped("readme.txt"), "unpack it"),
}


@pytest.mark.parametrize("name", FOREIGN)
def test_a_foreign_file_is_named_with_what_converts_it(tmp_path: Path, name: str) -> None:
    content, cure = FOREIGN[name]
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(EncoderError, match=re.escape(cure)) as caught:
        load_encoder(str(path))
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_weights_that_were_left_behind_are_named(tmp_path: Path) -> None:
    import onnx

    model = onnx.load(write_classifier(tmp_path / "whole.onnx"))
    place: dict[str, Any] = {"save_as_external_data": True, "location": "tiny.onnx.data"}
    onnx.save(model, tmp_path / "tiny.onnx", **place, size_threshold=0)
    (tmp_path / "tiny.onnx.data").unlink()
    with pytest.raises(EncoderError, match=r"weights in tiny\.onnx\.data, which is missing; copy"):
        load_encoder(str(tmp_path / "tiny.onnx"))


def test_a_file_that_leaves_its_size_open_is_run_at_224_px(tmp_path: Path) -> None:
    from onnx import helper

    nodes = [
        helper.make_node("Conv", ["pixels", "kernel"], ["map"], strides=[4, 4]),
        helper.make_node("ReduceMean", ["map"], ["mean"], axes=[2, 3], keepdims=0),
    ]
    path = write_graph(tmp_path / "open.onnx", ["n", 3, "h", "w"], nodes, ["mean"])
    encoder = load_file_encoder(path)
    assert (encoder.side, encoder.dimension) == (224, 8)
    left, right = (
        Crop(picture(1, 224), np.roll(np.arange(224 * 224).reshape(224, 224) < 25_088, by, 0))
        for by in (0, 112)
    )
    first, second = encoder.embed([left, right])
    assert np.abs(first - second).max() > 1e-3


FIRST, LAST, OPEN = [1, 3, SIDE, SIDE], [1, SIDE, SIDE, 3], ["n", "c", "h", "w"]
Op = tuple[str, list[str], list[str], dict[str, Any]]  # kind, inputs, outputs, attributes
TO_FIRST: Op = ("Transpose", ["pixels"], ["input"], {"perm": [0, 3, 1, 2]})
TO_GREY: Op = ("Concat", ["pixels"] * 3, ["input"], {"axis": 1})
MEAN: Op = ("GlobalAveragePool", ["map"], ["out"], {})
ROW: Op = ("Flatten", ["out"], ["row"], {})
UNIT: Op = ("LpNormalization", ["row"], ["unit"], {"axis": 1})
SAME: Op = ("Identity", ["map"], ["out"], {})
POOL: Op = ("AveragePool", ["map"], ["out"], {"kernel_shape": [4, 4]})
TO_LAST: Op = ("Transpose", ["map"], ["last"], {"perm": [0, 2, 3, 1]})
SHAPE: Op = ("Constant", [], ["shape"], {"value_ints": [1, 8, -1]})
CELLS: tuple[Op, ...] = (SHAPE, ("Reshape", ["map", "shape"], ["cells"], {}))
PATCHES = (*CELLS, ("Transpose", ["cells"], ["patches"], {"perm": [0, 2, 1]}))
SCORES: Op = ("MatMul", ["row", "dense"], ["scores"], {})
SHARES: Op = ("Softmax", ["scores"], ["shares"], {})


def filled(name: str, *size: int) -> tuple[Op, Op]:
    """A tensor of zeros of this size."""
    to_size: Op = ("Constant", [], [f"{name} size"], {"value_ints": list(size)})
    return to_size, ("ConstantOfShape", [f"{name} size"], [name], {})


def mean_of(name: str, *axes: int) -> Op:
    return ("ReduceMean", [name], ["out"], {"axes": list(axes), "keepdims": 0})


def tokens(before: int) -> tuple[Op, ...]:
    joined: Op = ("Concat", ["whole", "patches"], ["out"], {"axis": 1})
    return (*PATCHES, *filled("whole", 1, before, 8), joined)


# One network as exporters write it: the sizes and the type (of ONNX) of its input, what comes
# before its convolution and after it, and its output.
SHAPES: dict[str, dict[str, Any]] = {
    "plain": {},
    "any number of pictures": {"sizes": ["n", 3, SIDE, SIDE]},
    "open size": {"sizes": ["n", 3, "h", "w"]},
    "open height": {"sizes": ["n", 3, "h", SIDE]},
    "every axis open": {"sizes": OPEN},
    "no names of axes": {"sizes": [None] * 4},
    "colours last": {"sizes": LAST, "before": (TO_FIRST,)},
    "colours last, open size": {"sizes": [1, "h", "w", 3], "before": (TO_FIRST,)},
    "colours last, every axis open": {"sizes": OPEN, "before": (TO_FIRST,)},
    "half floats": {"kind": 10},
    "half floats, colours last": {"kind": 10, "sizes": LAST, "before": (TO_FIRST,)},
    "the map alone": {"after": (SAME,)},
    "a mean without places": {"after": (mean_of("map", 2, 3),)},
    "a mean of a map with features last": {"after": (TO_LAST, mean_of("last", 1, 2))},
    "a pool of the whole map": {"after": (POOL,)},
    "patches": {"after": PATCHES, "output": ("patches",)},
    "patches behind a class token": {"after": tokens(1)},
    "patches behind registers": {"after": tokens(5)},
    "a mean of patches": {"after": (*PATCHES, mean_of("patches", 1))},
    "the pooled vector": {"after": (MEAN, ROW), "output": ("row",)},
    "a vector of unit length": {"after": (MEAN, ROW, UNIT), "output": ("unit",)},
    "other classes": {"after": (MEAN, ROW, *filled("dense", 8, 12), SCORES), "output": ("scores",)},
    "1,000 classes": {
        "after": (MEAN, ROW, *filled("dense", 8, 1000), SCORES),
        "output": ("scores",),
    },
    "1,000 shares": {
        "after": (MEAN, ROW, *filled("dense", 8, 1000), SCORES, SHARES),
        "output": ("shares",),
    },
    "two pictures at once": {"sizes": [2, 3, SIDE, SIDE]},
    "an oblong": {"sizes": ["n", 3, SIDE, 2 * SIDE]},
    "grey alone": {"sizes": [1, 1, SIDE, SIDE], "before": (TO_GREY,)},
}
REFUSED = {
    "two pictures at once": "export it for 1 or any number",
    "an oblong": "not a square",
    "grey alone": r"not \(N, S, S, 3\) or \(N, 3, S, S\)",
}


def exported(
    folder: Path,
    sizes: Sequence[Any] = FIRST,
    kind: int = 1,
    before: Sequence[Op] = (),
    after: Sequence[Op] = (MEAN,),
    output: Sequence[str] = ("out",),
) -> Path:
    from onnx import helper

    source = "input" if before else "pixels"
    conv: Op = ("Conv", [source, "kernel"], ["map"], {"strides": [8, 8]})
    ops = (*before, conv, *after)
    nodes = [helper.make_node(op, given, gives, **how) for op, given, gives, how in ops]
    fields = {"size": SIDE, "image_mean": [0.5] * 3, "image_std": [0.25] * 3}
    (folder / "onnx").mkdir(parents=True)
    (folder / "preprocessor_config.json").write_text(json.dumps(fields))
    return write_graph(folder / "onnx" / "net.onnx", sizes, nodes, list(output), kind)


def test_twenty_four_of_twenty_seven_shapes_of_a_network_are_the_plain_one(tmp_path: Path) -> None:
    full = Crop(picture(2, SIDE), np.full((SIDE, SIDE), 255, np.uint8))
    plain = load_file_encoder(exported(tmp_path / "first")).embed([full])[0]
    assert len(SHAPES) == 27
    unlike = []
    for shape, how in SHAPES.items():
        path = exported(tmp_path / shape, **how)
        if shape in REFUSED:
            with pytest.raises(EncoderError, match=REFUSED[shape]):
                load_file_encoder(path)
            continue
        encoder = load_file_encoder(path)
        found = encoder.embed([full])
        features = joint_embedding.features_of(found) if encoder.beliefs else found
        if features.shape[1] != len(plain) or not features[0] @ plain >= 0.98:
            unlike.append(shape)
    assert unlike == []


@pytest.mark.parametrize("before", [0, 1, 5])
def test_tokens_are_averaged_under_the_mask_without_those_of_the_whole_picture(
    tmp_path: Path, before: int
) -> None:
    largest: Op = ("ReduceMax", ["patches"], ["pooler_output"], {"axes": [1], "keepdims": 0})
    paths = (
        exported(tmp_path / "map", after=(MEAN, ROW), output=("row",)),
        exported(
            tmp_path / "tokens", after=(*tokens(before), largest), output=("out", "pooler_output")
        ),
    )
    by_map, by_tokens = (
        load_file_encoder(path).embed([masked(left=True), masked(left=False)]) for path in paths
    )
    assert np.allclose(by_tokens, by_map, atol=1e-5)
    assert np.abs(by_tokens[0] - by_tokens[1]).max() > 1e-3


def test_the_reason_of_onnxruntime_is_said_and_not_where_its_source_says_so(
    tmp_path: Path,
) -> None:
    import onnx

    model = onnx.load(write_classifier(tmp_path / "new.onnx"))
    model.ir_version = 99
    (tmp_path / "new.onnx").write_bytes(model.SerializeToString())
    with pytest.raises(EncoderError, match=r"IR version: 99") as caught:
        load_encoder(str(tmp_path / "new.onnx"))
    assert ".cc" not in str(caught.value)


def test_weights_are_read_from_the_folder_of_the_file_alone(tmp_path: Path) -> None:
    import onnx

    path = write_classifier(tmp_path / "tiny.onnx")
    whole = load_file_encoder(path).embed([crop(1, SIDE)])
    apart = tmp_path / "apart"
    apart.mkdir()
    onnx.save(
        onnx.load(path),
        apart / "tiny.onnx",
        save_as_external_data=True,
        location="tiny.weights",
        size_threshold=0,
    )
    assert np.allclose(load_encoder(str(apart / "tiny.onnx")).embed([crop(1, SIDE)]), whole)
    model = onnx.load(apart / "tiny.onnx", load_external_data=False)
    for tensor in model.graph.initializer:
        for entry in tensor.external_data:
            entry.value = "../tiny.weights" if entry.key == "location" else entry.value
    (apart / "tiny.onnx").write_bytes(model.SerializeToString())
    (apart / "tiny.weights").rename(tmp_path / "tiny.weights")
    with pytest.raises(EncoderError, match=r"tiny\.onnx` cannot be read"):
        load_encoder(str(apart / "tiny.onnx"))


def test_a_joined_embedding_gives_back_both_parts() -> None:
    rng = np.random.default_rng(1)
    features = rng.normal(size=(5, 20)).astype(np.float32)
    features /= np.linalg.norm(features, axis=1, keepdims=True)
    beliefs = rng.dirichlet([0.2] * joint_embedding.BELIEFS, 5).astype(np.float32)
    joined = joint_embedding.join(features, beliefs)
    assert np.allclose(np.linalg.norm(joined, axis=1), 1.0, atol=1e-5)
    assert np.allclose(joint_embedding.features_of(joined), features, atol=1e-5)
    logs = np.log(np.minimum(beliefs, 1.0 - joint_embedding.FLOOR) + joint_embedding.FLOOR)
    assert np.allclose(joint_embedding.log_beliefs(joined), logs, atol=1e-4)
    weights = rng.normal(size=(20, joint_embedding.BELIEFS)).astype(np.float32)
    found = joined @ joint_embedding.layer_of(weights, 0.5) - features @ weights - 0.5 * logs
    assert np.allclose(found - found[:, :1], 0.0, atol=1e-3)


def test_the_table_names_every_class_once_and_every_material() -> None:
    rows = [line.split(",") for line in joint_embedding.TABLE.read_text().splitlines()[1:]]
    numbers = [int(row[0]) for row in rows]
    assert numbers == sorted(set(numbers))
    assert all(row[1] for row in rows)
    assert (joint_embedding.material_weights().sum(axis=0) > 5).all()
    assert joint_embedding.material_weights().shape == (1000, len(materials.MATERIALS))
