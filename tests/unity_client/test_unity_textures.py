"""Texture maps of surfaces in the stand-in of the engine, against the real service."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from drawn_textures import planks, weave
from pace import PACE
from PIL import Image

pytest_plugins = ("mono_build",)
HERE = Path(__file__).parent
LABEL = (40, 24)  # px, smaller than what is sent at most, and not square
SIZES = ("planks:512x512", "label:40x24", "weave:256x256")
GREY = 127


def maps() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return each map as it is and as it is sent: RGBA, the first row is the top."""
    boards = opaque(planks(512))
    cloth = opaque(weave())
    cloth[..., 3] = 90  # of an opaque material: smoothness, not transparency
    label = np.random.default_rng(2).integers(0, 255, (LABEL[1], LABEL[0], 4), dtype=np.uint8)
    share = label[..., 3:].astype(int)
    blended = (label[..., :3] * share + GREY * (255 - share) + 127) // 255
    return {
        "planks": (boards, boards[::2, ::2]),  # the stand-in draws without filtering
        "label": (label, opaque(blended.astype(np.uint8))),
        "weave": (cloth, opaque(cloth[..., :3])),
    }


def opaque(pixels: np.ndarray) -> np.ndarray:
    return np.dstack([pixels, np.full(pixels.shape[:2], 255, np.uint8)])


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("maps")
    for name, (whole, sent) in maps().items():
        (folder / f"{name}.rgba").write_bytes(whole.tobytes())
        (folder / f"{name}.drawn.rgba").write_bytes(sent.tobytes())
        Image.fromarray(sent[..., :3]).save(folder / f"{name}.jpg", quality=92)
    return folder


@pytest.fixture(scope="module")
def output(build, service, files):
    return build.run("components.exe", "TextureRooms.Run", service.url, str(files), ",".join(SIZES))


def test_maps_that_neither_name_nor_shader_tells_are_sent_once_and_decide(output):
    assert re.findall(r"^decided (.+)$", output, re.MULTILINE) == [
        "0 wood by Texture",
        "2 fabric by Texture",
    ]
    assert "encoded 2 unknown 0" in output  # and not again, though the object was described again


def test_a_map_is_drawn_small_after_the_first_seconds_of_a_scene_and_a_lost_device_loses_none(
    output,
):
    assert "first map after 2 s" in output
    drawn = re.search(r"blits (\d+) active True exceptions 0 errors 0", output)
    assert drawn
    assert int(drawn.group(1)) in (6, 7)  # three hashes, two maps; one or two while lost
    assert "left textures 0" in output
    assert "threads left 0" in output


@pytest.mark.needs_toolchain("node")
def test_the_same_pixels_have_the_same_hash_in_the_npm_client(output, files):
    command = ["node", str(HERE / "hash_textures.mjs")]
    for name, (_, sent) in maps().items():
        command += [str(files / f"{name}.drawn.rgba"), str(sent.shape[1]), str(sent.shape[0])]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=60.0 * PACE, check=True)
    stated = re.findall(r"^stated T_(\S+) (\S+)$", output, re.MULTILINE)
    assert [name for name, _ in stated] == ["planks/mat14", "label/Oak_Floor", "weave/mat15"]
    assert [text for _, text in stated] == ran.stdout.split()
