"""A room that is one mesh of twenty materials, read by three.js and touched, in real Chromium."""

from __future__ import annotations

import io
import json
import shutil
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest
from PIL import Image
from playwright.sync_api import Page
from webxr_scene import EXAMPLES, PATIENCE_MS, served

pytestmark = [pytest.mark.browser, pytest.mark.needs_toolchain("chromium", "three")]

WEBXR = EXAMPLES / "webxr"
METALLIC = {"metallicFactor": 1.0, "roughnessFactor": 0.2, "baseColorFactor": [0.7, 0.7, 0.7, 1]}
# The name of each material, its shader parameters and what it is.
MATERIALS: list[tuple[str, dict[str, Any], str]] = [
    ("Oak_Floor", {}, "wood"),
    ("M_WindowGlass", {}, "glass"),
    ("Curtain_Linen", {}, "fabric"),
    ("Stainless_Steel", {}, "metal"),
    ("Concrete_Wall", {}, "stone"),
    ("Bathroom_Ceramic", {}, "ceramic"),
    ("mat5", {"baseColorTexture": {"index": 0}}, "leather"),
    ("Rubber_Mat", {}, "rubber"),
    ("Plastic_White", {}, "plastic"),
    ("Cardboard", {}, "paper"),
    ("mat14", METALLIC, "metal"),
    ("Walnut", {}, "wood"),
    ("Velvet_Red", {}, "fabric"),
    ("Marble_Tiles", {}, "stone"),
    ("Brass", {}, "metal"),
    ("Pine_Planks", {}, "wood"),
    ("Wool_Carpet", {}, "fabric"),
    ("Porcelain", {}, "ceramic"),
    ("Copper", {}, "metal"),
    ("Brick_Wall", {}, "stone"),
]
PICTURE = "T_Leather_D.png"  # of the material that has one, inside the file
ACROSS = 5  # tiles in a row; the n-th tile is smaller than those before it
# Reads the room, makes one mesh with groups of it if asked to, and touches the middle of each tile.
TOUCH_ALL = """async ([isOneMesh, wanted, patience]) => {
  const THREE = await import('three');
  const {GLTFLoader} = await import('three/addons/loaders/GLTFLoader.js');
  const {mergeGeometries} = await import('three/addons/utils/BufferGeometryUtils.js');
  const {Haptics, surfaceAt, surfacesOf} = await import('hapticvlm');
  const {scene} = await new GLTFLoader().loadAsync('room.glb');
  const parts = [];
  scene.traverse((node) => node.isMesh && parts.push(node));
  const merged = () => mergeGeometries(parts.map(({geometry}) => geometry), true);
  const room = isOneMesh ? new THREE.Mesh(merged(), parts.map(({material}) => material)) : scene;
  room.updateMatrixWorld(true);
  const haptics = new Haptics(`ws://${location.host}/`);
  const next = (type) => new Promise((resolve, reject) => {
    haptics.addEventListener(type, ({detail}) => resolve(detail), {once: true});
    setTimeout(() => reject(new Error(`no ${type}: ${haptics.silence} ${refused}`)), patience);
  });
  const refused = [];
  haptics.addEventListener('refused', ({detail}) => refused.push(detail.text));
  await next('welcome');
  const surfaces = surfacesOf(room);
  haptics.scene([{object_id: 'room', name: 'mesh2057757694', surfaces}]);
  const felt = [];
  const down = new THREE.Vector3(0, -1, 0);
  for (let i = 0; i < wanted; i++) {
    const middle = new THREE.Vector3(2 * (i % ACROSS), 1, 2 * Math.floor(i / ACROSS));
    const [hit] = new THREE.Raycaster(middle, down).intersectObject(room, true);
    const surface = surfaceAt(room, hit);
    const decided = next('decision');
    const phase = i ? 'slide' : 'contact';
    const motion = {hand: 'right', speed_mps: 0.3, force_n: 1.5};
    haptics.touch({phase, object_id: 'room', surface, ...motion});
    const {material, surface: decidedOn} = await decided;
    felt.push({material, surface, decidedOn});
  }
  haptics.close();
  return {felt, refused, parts: parts.length, names: surfaces.map(({name}) => name)};
}""".replace("ACROSS", str(ACROSS))


@dataclass
class Visit:
    """The page, and what it complained of."""

    page: Page
    complaints: list[str] = field(default_factory=list)

    def hear(self, said: Any) -> None:
        if said.type == "error":
            self.complaints.append(said.text)


@pytest.fixture(scope="module")
def visit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visit]:
    folder = tmp_path_factory.mktemp("scene")
    for module in ("three/build", "three/examples/jsm/loaders", "three/examples/jsm/utils"):
        shutil.copytree(WEBXR / "node_modules" / module, folder / "node_modules" / module)
    shutil.copytree(WEBXR / "node_modules" / "@msgpack", folder / "node_modules" / "@msgpack")
    shutil.copytree(WEBXR / "client", folder / "client")
    (folder / "room.glb").write_bytes(room())
    head, _, rest = (WEBXR / "index.html").read_text(encoding="utf-8").partition("<script")
    imports, end, _ = rest.partition("</script>")
    head = head.replace('<link rel="stylesheet" href="page.css">', "")
    (folder / "empty.html").write_text(f"{head}<script{imports}{end}</head></html>")
    with served((120, 90), folder) as (service, page):
        visit = Visit(page)
        page.on("pageerror", lambda error: visit.complaints.append(str(error)))
        page.on("console", visit.hear)
        page.goto(f"{service.page}scene/empty.html")
        yield visit


def picture() -> bytes:
    """Return a small PNG."""
    file = io.BytesIO()
    Image.new("RGB", (4, 4), (90, 60, 40)).save(file, "PNG")
    return file.getvalue()


def room() -> bytes:
    """Return a glTF file: one node, one mesh, a square primitive for each material."""
    data = b""
    accessors: list[dict[str, Any]] = []
    views, primitives, materials = [], [], []
    for number, (name, factors, _) in enumerate(MATERIALS):
        x, z, half = 2 * (number % ACROSS), 2 * (number // ACROSS), 0.9 - 0.02 * number
        corners = [
            (x + half * u, 0.0, z + half * v) for u, v in ((-1, -1), (-1, 1), (1, 1), (1, -1))
        ]
        positions = b"".join(struct.pack("<3f", *corner) for corner in corners)
        indices = struct.pack("<6H", 0, 1, 2, 0, 2, 3)
        for part, kind, component, count in (
            (positions, "VEC3", 5126, 4),
            (indices, "SCALAR", 5123, 6),
        ):
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(part)})
            accessors.append(
                {"bufferView": len(views) - 1, "componentType": component, "count": count}
                | {"type": kind}
            )
            data += part
        accessors[-2] |= {
            "min": [min(axis) for axis in zip(*corners, strict=True)],
            "max": [max(axis) for axis in zip(*corners, strict=True)],
        }
        material = {"metallicFactor": 0.0, "roughnessFactor": 0.8, **factors}
        materials.append({"name": name, "pbrMetallicRoughness": material, "doubleSided": True})
        primitive = {"attributes": {"POSITION": 2 * number}, "indices": 2 * number + 1}
        primitives.append({**primitive, "material": number})
    pixels = picture()
    views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(pixels)})
    data += pixels + bytes(-len(pixels) % 4)
    image = {"name": PICTURE, "bufferView": len(views) - 1, "mimeType": "image/png"}
    described = json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "name": "mesh2057757694"}],
            "meshes": [{"primitives": primitives}],
            "materials": materials,
            "textures": [{"source": 0}],
            "images": [image],
            "accessors": accessors,
            "bufferViews": views,
            "buffers": [{"byteLength": len(data)}],
        }
    ).encode()
    described += b" " * (-len(described) % 4)
    chunks = struct.pack("<I4s", len(described), b"JSON") + described
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.mark.parametrize("is_one_mesh", [False, True], ids=["as GLTFLoader makes it", "of groups"])
def test_each_surface_of_a_mesh_of_twenty_materials_is_felt_as_what_it_is(
    visit: Visit, is_one_mesh: bool
) -> None:
    seen = visit.page.evaluate(TOUCH_ALL, [is_one_mesh, len(MATERIALS), PATIENCE_MS])

    assert seen["parts"] == len(MATERIALS)
    assert seen["refused"] == []
    names = [
        f"{PICTURE}/{name}" if "baseColorTexture" in factors else name
        for name, factors, _ in MATERIALS
    ]
    assert seen["names"] == names  # the largest first
    indices = [each["surface"] for each in seen["felt"]]
    assert indices == [each["decidedOn"] for each in seen["felt"]] == list(range(len(MATERIALS)))
    assert [each["material"] for each in seen["felt"]] == [truth for _, _, truth in MATERIALS]
    assert visit.complaints == []
