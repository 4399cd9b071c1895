"""The parts of the held-back set's renderer: shapes, cameras, patterns, models, development."""

import json
import struct
from collections import Counter
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from hapticvlm_lab.training.held_back import (
    cameras,
    denoise,
    develop,
    gltf,
    meshes,
    patterns,
    plan,
    shapes,
)

pytestmark = pytest.mark.nightly

PRIMITIVE = {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}


def test_every_common_shape_is_worn_by_several_classes() -> None:
    worn = {(made.shape, made.truth) for made in plan.approaches()}
    classes = Counter(shape for shape, _ in worn)
    assert all(classes[shape] >= 4 for shape in shapes.COMMON), classes
    assert len({made.object_id for made in plan.approaches()}) == len(plan.approaches())


@pytest.mark.parametrize("name", shapes.SHAPES)
def test_a_shape_stands_on_the_table_and_has_a_radius_of_one(name: str) -> None:
    mesh = shapes.make(name, np.random.default_rng(3))
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    assert low[1] == pytest.approx(0, abs=1e-9)
    radius = np.linalg.norm(mesh.points - (low + high) / 2, axis=1).max()
    assert radius == pytest.approx(1, abs=0.02)
    assert np.isfinite(mesh.normals).all()
    a, b, c = np.moveaxis(mesh.points[mesh.faces], 1, 0)
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
    assert not mesh.closed or 0.02 < volume < 4 / 3 * np.pi


@pytest.mark.parametrize("share", [cameras.FAR, cameras.NEAR])
def test_a_camera_is_as_far_as_the_object_fills_its_share(share: float) -> None:
    points = shapes.make("vase", np.random.default_rng(1)).points
    views = cameras.approach(points, np.random.default_rng(2))
    first_or_last = views[0] if share == cameras.FAR else views[-1]
    assert cameras.filled(points, first_or_last) == pytest.approx(share, rel=0.02)


def test_an_orbit_turns_half_a_degree_a_frame() -> None:
    points = shapes.make("box", np.random.default_rng(1)).points
    views = cameras.orbit(points, np.random.default_rng(2), 5)
    around = [np.arctan2(*(view.eye - view.target)[[2, 0]]) for view in views]
    assert np.degrees(np.diff(np.unwrap(around))) == pytest.approx(0.5, abs=1e-6)


def test_patterns_tile_and_stay_in_range() -> None:
    rng = np.random.default_rng(0)
    drawn = [patterns.noise(rng), patterns.weave(12), patterns.weave(9, 2), patterns.knit(8)]
    for pattern in [*drawn, patterns.cells(rng, 50)[0], patterns.grooves(6)]:
        assert pattern.min() >= 0
        assert pattern.max() <= 1
        inside = np.abs(np.diff(pattern, axis=0)).max()
        assert np.abs(pattern[0] - pattern[-1]).max() <= inside + 1e-6


def test_a_model_is_read_from_both_kinds_of_file(tmp_path: Path) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1]], "<f4")
    uv = np.array([[0, 0], [1, 0], [0, 1]], "<f4")
    binary = points.tobytes() + uv.tobytes() + np.array([0, 1, 2], "<u2").tobytes()
    tree = gltf_tree(len(binary))
    (tmp_path / "one.bin").write_bytes(binary)
    (tmp_path / "one.gltf").write_text(json.dumps(tree))
    text = json.dumps(tree).encode()
    head = struct.pack("<4sIII4s", b"glTF", 2, 0, len(text), b"JSON")
    chunk = struct.pack("<I4s", len(binary), b"BIN\0") + binary
    (tmp_path / "one.glb").write_bytes(head + text + chunk)
    upright = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    for name in ("one.gltf", "one.glb"):
        (part,) = gltf.read_model(tmp_path / name, z_up=True)
        assert part.mesh.points == pytest.approx(upright, abs=1e-6)
        assert part.roughness == 0.25


def gltf_tree(size: int) -> dict[str, object]:
    views = [(0, 36), (36, 24), (60, 6)]
    return {
        "buffers": [{"uri": "one.bin", "byteLength": size}],
        "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": n} for at, n in views],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "materials": [{"pbrMetallicRoughness": {"roughnessFactor": 0.25}}],
        "meshes": [{"primitives": [PRIMITIVE]}],
        "nodes": [{"mesh": 0}],
    }


def test_sharp_edges_of_a_model_without_normals_stay_sharp() -> None:
    corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = np.array([[0, 1, 2], [0, 3, 1]])
    bare = meshes.Mesh(corner, np.zeros((4, 3)), corner[:, :2], faces, closed=False)
    assert np.abs(meshes.creased(bare).normals).max(axis=1) == pytest.approx(1)


def test_noise_is_taken_out_and_texture_stays() -> None:
    rng = np.random.default_rng(4)
    bands = np.where(np.arange(32) // 4 % 2, 0.2, 0.6)
    truth = np.tile(bands[None, None, :, None], (1, 32, 1, 3))
    one, other = (truth * rng.gamma(25, 1 / 25, truth.shape) for _ in range(2))
    clean = denoise.denoise(one, other)
    before, after = (np.abs(x - truth).mean() for x in ((one + other) / 2, clean))
    assert after < 0.7 * before
    assert denoise.denoise(truth, truth) == pytest.approx(truth, abs=1e-3)


def test_an_object_is_never_exposed_to_white() -> None:
    linear = np.full((1, 8, 8, 3), 0.01, np.float32)
    linear[:, 2:6, 2:6] = 50.0
    mask = (linear[..., 0] > 1).astype(np.float32)
    gain = develop.exposure(linear, mask, np.random.default_rng(0))
    assert 50.0 * gain <= 0.9 + 1e-6


def test_a_mask_is_a_png_of_8_bits_that_any_reader_reads() -> None:
    covered = np.linspace(0, 1, 12 * 7, dtype=np.float32).reshape(12, 7)
    with Image.open(BytesIO(develop.mask_png(covered))) as mask:
        assert (mask.format, mask.mode, mask.size) == ("PNG", "L", (7, 12))
        assert (np.asarray(mask) == np.where(covered >= 0.5, 255, 0)).all()
