"""A room that is one mesh of twenty materials, read by three.js and touched, in real Chromium."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest
from gltf_room import SURFACES, write_room
from playwright.sync_api import Page
from webxr_scene import EXAMPLES, PATIENCE_MS, served

pytestmark = [pytest.mark.browser, pytest.mark.needs_toolchain("chromium", "three")]

WEBXR = EXAMPLES / "webxr"
# Where a ray from above meets the surfaces whose middle lies below another one, m: x, z.
SEEN = {"Oak_Parquet": (2.5, 2.5), "Wool_Carpet": (1.6, 1.2)}
# Reads the room, makes one mesh with groups of it if asked to, and touches each surface from above.
TOUCH_ALL = """async ([isOneMesh, places, patience]) => {
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
  for (const [x, z] of places) {
    const above = new THREE.Vector3(x, 9, z);
    const [hit] = new THREE.Raycaster(above, down).intersectObject(room, true);
    const surface = surfaceAt(room, hit);
    const decided = next('decision');
    const phase = felt.length ? 'slide' : 'contact';
    const motion = {hand: 'right', speed_mps: 0.3, force_n: 1.5};
    haptics.touch({phase, object_id: 'room', surface, ...motion});
    const {material, surface: decidedOn} = await decided;
    felt.push({material, surface, decidedOn});
  }
  haptics.close();
  return {felt, refused, parts: parts.length, names: surfaces.map(({name}) => name)};
}"""


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
    write_room(folder / "room.glb")
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


@pytest.mark.parametrize("is_one_mesh", [False, True], ids=["as GLTFLoader makes it", "of groups"])
def test_each_surface_of_a_mesh_of_twenty_materials_is_felt_as_what_it_is(
    visit: Visit, is_one_mesh: bool
) -> None:
    largest_first = sorted(SURFACES, key=lambda one: -area(one.size))
    places = [SEEN.get(one.name, one.center[::2]) for one in largest_first]
    seen = visit.page.evaluate(TOUCH_ALL, [is_one_mesh, places, PATIENCE_MS])

    assert seen["parts"] == len(SURFACES)
    assert seen["refused"] == []
    names = [f"{one.texture}/{one.name}" if one.texture else one.name for one in largest_first]
    assert seen["names"] == names
    indices = [each["surface"] for each in seen["felt"]]
    assert indices == [each["decidedOn"] for each in seen["felt"]] == list(range(len(SURFACES)))
    assert [each["material"] for each in seen["felt"]] == [one.material for one in largest_first]
    assert visit.complaints == []


def area(size: tuple[float, float, float]) -> float:
    x, y, z = size
    return 2 * (x * y + y * z + z * x)
