"""Reads textures of a scene with the shipped encoder, as the service reads those of a client."""

from __future__ import annotations

from pathlib import Path

import pytest
from drawn_textures import planks, png

from hapticvlm.scenes import texture_reader
from hapticvlm.scenes.scan import scan
from hapticvlm.scenes.scene import SceneError, SceneNode, Surface, Texture
from hapticvlm.scenes.texture_reader import TextureReader
from hapticvlm.vision.files import read_frame
from hapticvlm.vision.frame_recogniser import FrameRecogniser
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.loading import load_encoder


@pytest.fixture(autouse=True)
def cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A folder of the test's own for what texture maps showed."""
    folder = tmp_path / "cache"
    monkeypatch.setattr(texture_reader, "cache_folder", lambda: folder)
    return folder


@pytest.fixture
def picture() -> bytes:
    return png(planks())


def test_a_texture_shows_what_the_service_sees_in_it_and_is_read_once(
    picture: bytes, tmp_path: Path, cache: Path
) -> None:
    (tmp_path / "map.png").write_bytes(picture)
    encoder = load_encoder(None)
    service = FrameRecogniser(encoder, load_gallery(None, encoder=encoder))
    seen = service.read_texture(read_frame(tmp_path / "map.png"))
    look = TextureReader()
    assert look(Texture("map.png", lambda: picture)) == seen
    assert seen.rung == "texture"
    assert look.problems == []
    (kept,) = cache.iterdir()
    before = kept.read_bytes()
    assert TextureReader()(Texture("another.png", lambda: picture)) == seen
    assert kept.read_bytes() == before


def test_what_cannot_be_read_is_told_by_name_and_leaves_the_verdict_open() -> None:
    def gone() -> bytes:
        raise SceneError("gone.png: no such file")

    look = TextureReader()
    broken = (Texture("a.png", gone), Texture("b.png", lambda: b"none"), Texture(None, lambda: b""))
    node = SceneNode("x", ("x",), tuple(Surface("m", None, each, 1) for each in broken))
    rows = list(scan([(node, at) for at in range(len(broken))], look=look))
    assert {row.sureness for row in rows} == {"unknown"}
    assert [problem.split()[0].rstrip(":") for problem in look.problems] == ["a.png", "b.png", "a"]
