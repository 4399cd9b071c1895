"""`hapticvlm recognise`: the real command on real files, with the shipped encoder."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drawn_textures import planks, weave
from each_case import each_row
from grounds import drawn
from in_process import Outcome, hapticvlm
from numpy.typing import NDArray
from PIL import Image
from tiny_encoders import write_classifier
from word_tables import words

from hapticvlm import materials, messages
from hapticvlm.commands.main import main
from hapticvlm.demo import CAPTURE
from hapticvlm.evidence.ladder import decide
from hapticvlm.vision.frame_recogniser import FrameRecogniser
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.loading import load_encoder

SIDE = 160
WRONG = Path(__file__).with_name("wrong_files.csv")
COMMAND = [sys.executable, "-m", "hapticvlm", "recognise"]


class Rows(Outcome):
    @property
    def rows(self) -> list[dict[str, Any]]:
        return [json.loads(line) for line in self.out.splitlines()]


def recognise(*arguments: str | Path) -> Rows:
    return Rows(**vars(hapticvlm("recognise", *arguments)))


def best(row: dict[str, Any]) -> str | None:
    """The best guess, said or not: how sure the shipped encoder is of drawn stripes is its own."""
    return row["runner_up"] if row["material"] == materials.UNKNOWN else row["material"]  # type: ignore[no-any-return]


def grain(seed: int) -> NDArray[np.uint8]:
    """Stripes, something like wood."""
    rng = np.random.default_rng(seed)
    rows = 20 * np.sin(np.arange(SIDE) / rng.uniform(2, 4)) + rng.normal(0, 6, (SIDE, SIDE))
    colour = np.array((150, 100, 60)) + rng.normal(0, 8, 3)
    return (colour + rows[:, :, None]).clip(0, 255).astype(np.uint8)


def speckle(seed: int) -> NDArray[np.uint8]:
    """Cold speckles, something like stone."""
    rng = np.random.default_rng(seed)
    spots = np.kron(rng.normal(0, 40, (SIDE // 4, SIDE // 4)), np.ones((4, 4)))
    return (np.array((90, 110, 130)) + spots[:, :, None]).clip(0, 255).astype(np.uint8)  # type: ignore[no-any-return]


def save(path: Path, pixels: NDArray[np.uint8], **options: Any) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(pixels).save(path, **options)
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Pictures whose names lie about what they show, and a mask for two of three."""
    root = tmp_path_factory.mktemp("pictures")
    for seed, name in enumerate(("c_metal.jpg", "a_glass.png", "b_stone.webp")):
        save(root / "scene" / name, grain(seed))
    left, right = np.zeros((2, SIDE, SIDE), np.uint8)
    left[:, : SIDE // 2], right[:, SIDE // 2 :] = 255, 255
    for name, mask in (("c_metal", left), ("a_glass", right)):
        save(root / "masks" / f"{name}.png", mask)
    halves = np.concatenate([grain(7)[:, : SIDE // 2], speckle(7)[:, SIDE // 2 :]], axis=1)
    save(root / "halves.png", halves)
    save(root / "left.png", left)
    save(root / "right.png", right)
    return root


@pytest.fixture(scope="module")
def own_gallery(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A gallery of a scene's own two materials, made by the command for it."""
    root = tmp_path_factory.mktemp("enrolled")
    for seed in range(100, 106):
        save(root / "pictures" / "wood" / f"{seed}.png", grain(seed))
        save(root / "pictures" / "stone" / f"{seed}.png", speckle(seed))
    made = root / "own.npz"
    assert main(["gallery", "build", str(root / "pictures"), "-o", str(made)]) == 0
    return made


def test_each_picture_has_a_line_of_json_in_the_order_given(folder: Path) -> None:
    paths = [folder / "scene" / name for name in ("c_metal.jpg", "a_glass.png", "b_stone.webp")]
    outcome = recognise("--json", *paths)
    assert (outcome.code, outcome.err) == (0, "")
    assert [row["path"] for row in outcome.rows] == [str(path) for path in paths]
    for row in outcome.rows:
        names = ["path", "material", "confidence", "runner_up", "source", "outlined", "beliefs"]
        assert list(row) == names
        assert sum(row["beliefs"].values()) <= 1.0 + 1e-3
        assert list(row["beliefs"].values()) == sorted(row["beliefs"].values(), reverse=True)
        assert row["material"] in (*materials.MATERIALS, materials.UNKNOWN)
        assert 0.0 <= row["confidence"] <= 1.0
        assert row["source"] in ("encoder", "unknown")
        assert (row["source"] == "unknown") == (row["material"] == materials.UNKNOWN)


def test_a_folder_is_its_pictures_in_order_and_neither_names_nor_neighbours_sway_them(
    folder: Path, tmp_path: Path
) -> None:
    (tmp_path / "phone.HEIC").write_bytes(b"\0\0\0\x18ftypheic" + bytes(8))
    (tmp_path / "Oak_Table.jfif").write_bytes((folder / "scene" / "c_metal.jpg").read_bytes())
    outcome = recognise("--json", folder / "halves.png", folder / "scene", tmp_path)
    names = ["halves.png", "a_glass.png", "b_stone.webp", "c_metal.jpg", "Oak_Table.jfif"]
    assert [Path(row["path"]).name for row in outcome.rows] == names
    assert "left out: 1 HEIC; save them as JPEG" in outcome.err
    assert recognise("--json", folder / "scene" / "b_stone.webp").rows == [outcome.rows[2]]
    metal, oak = ({**row, "path": ""} for row in outcome.rows[-2:])
    assert metal == oak


def test_the_answer_is_the_one_the_service_gives_to_the_whole_frame(folder: Path) -> None:
    path = folder / "scene" / "c_metal.jpg"
    encoder = load_encoder()
    frame = messages.Frame(
        id=1,
        captured_at=0.0,
        format="jpeg",
        width=SIDE,
        height=SIDE,
        image=path.read_bytes(),
        origin="top",
    )
    recogniser = FrameRecogniser(encoder, load_gallery(encoder=encoder))
    expected = decide(recogniser.compare(frame, [messages.WHOLE]))
    (row,) = recognise("--json", path).rows
    assert row["confidence"] == pytest.approx(expected.confidence, abs=1e-3)
    assert (row["material"], row["runner_up"]) == (expected.material, expected.runner_up)


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drawn thing on a plain ground, and its mask."""
    root = tmp_path_factory.mktemp("catalogue")
    pixels, truth = drawn("thing")
    save(root / "mask.png", np.where(truth, 255, 0).astype(np.uint8))
    return save(root / "thing.png", pixels)


def test_a_thing_on_a_plain_ground_counts_by_itself_beside_the_whole_picture(
    catalogue: Path, folder: Path
) -> None:
    whole, masked = (
        recognise("--json", catalogue, *options).rows[0]
        for options in (["--no-outline"], ["--mask", catalogue.parent / "mask.png"])
    )
    (row, other) = recognise("--json", catalogue, folder / "halves.png").rows
    assert (whole["outlined"], masked["outlined"]) == (False, False)
    assert (row["outlined"], other["outlined"]) == (True, False)
    for name, belief in row["beliefs"].items():
        views = whole["beliefs"].get(name, 0.0), masked["beliefs"].get(name, 0.0)
        assert belief == pytest.approx(sum(views) / 2, abs=0.05)
    assert row["beliefs"] != whole["beliefs"]
    assert recognise(catalogue).out.splitlines()[1].endswith(", outlined")


def test_own_references_are_recognised_and_a_mask_says_which_object_is_meant(
    folder: Path, own_gallery: Path
) -> None:
    said = {}
    for side in ("left", "right"):
        mask = folder / f"{side}.png"
        outcome = recognise(
            "--json", "--gallery", own_gallery, "--mask", mask, folder / "halves.png"
        )
        (said[side],) = outcome.rows
    assert (best(said["left"]), best(said["right"])) == ("wood", "stone")


def test_a_folder_of_masks_goes_by_name_and_what_lacks_one_is_said(folder: Path) -> None:
    masked = recognise("--json", folder / "scene", "--mask", folder / "masks")
    plain = recognise("--json", folder / "scene")
    assert masked.code == 0
    assert "b_stone.webp: no mask" in masked.err
    assert len(masked.err.splitlines()) == 1
    one_for_all = recognise("--json", folder / "scene", "--mask", folder / "left.png")
    assert (one_for_all.code, one_for_all.err, len(one_for_all.rows)) == (0, "", 3)
    pairs = list(zip(masked.rows, plain.rows, strict=True))
    assert [one["confidence"] == other["confidence"] for one, other in pairs] == [
        False,
        True,
        False,
    ]


def test_a_broken_picture_is_said_and_the_others_are_done(folder: Path, tmp_path: Path) -> None:
    broken, torn = tmp_path / "broken.jpg", tmp_path / "torn.jpg"
    broken.write_bytes(b"\xff\xd8\xffnothing")
    whole = (folder / "scene" / "c_metal.jpg").read_bytes()
    torn.write_bytes(whole[: len(whole) // 2])
    good, missing = folder / "scene" / "a_glass.png", tmp_path / "missing.png"
    outcome = recognise("--json", broken, good, missing, torn, good)
    assert outcome.code == 1
    assert ["error" in row for row in outcome.rows] == [True, False, True, True, False]
    for row, path in zip(outcome.rows, (broken, good, missing, torn, good), strict=True):
        assert row["path"] == str(path)
    for path in (broken, missing, torn):
        assert str(path) in outcome.err
    assert len(outcome.err.splitlines()) == 3
    save(tmp_path / "masks" / "a_glass.png", np.full((8, 8), 255, np.uint8))
    outcome = recognise("--json", folder / "scene", "--mask", tmp_path / "masks")
    assert outcome.code == 1
    assert ["error" in row for row in outcome.rows] == [True, False, False]
    assert "8 x 8 px" in outcome.rows[0]["error"]


@each_row(("arguments", "complaint"), words(WRONG, "recognise"))
def test_what_cannot_be_looked_at_so_is_said_in_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: str, complaint: str
) -> None:
    (tmp_path / "empty" / "below").mkdir(parents=True, exist_ok=True)
    (tmp_path / "empty" / "notes.txt").write_text("no picture")
    save(tmp_path / "a.png", grain(1))
    monkeypatch.chdir(tmp_path)
    outcome = recognise(*arguments.split())
    assert (outcome.code, outcome.out) == (2, "")
    (line,) = outcome.err.splitlines()
    assert complaint in line


def test_without_json_a_table_is_printed(folder: Path, own_gallery: Path) -> None:
    outcome = recognise(
        folder / "halves.png", "--mask", folder / "right.png", "--gallery", own_gallery
    )
    head, line = outcome.out.splitlines()
    assert head.split() == ["picture", "material", "confidence", "runner-up", "source"]
    path, material, confidence, runner_up, source = line.split()
    assert path == str(folder / "halves.png")
    assert "stone" in (material, runner_up)
    assert source in ("encoder", "unknown")
    assert 0.0 <= float(confidence) <= 1.0


def test_a_picture_whose_name_has_no_encoding_is_recognised(folder: Path, tmp_path: Path) -> None:
    odd = tmp_path / "caf\udce9.png"
    odd.write_bytes((folder / "halves.png").read_bytes())
    command = [*COMMAND, "--json", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    assert json.loads(done.stdout)["path"] == str(odd)


def test_answers_come_as_they_are_known_and_a_reader_may_stop(folder: Path) -> None:
    many = [folder / "halves.png"] * 30  # less than a buffer holds, so only flushing shows it
    with subprocess.Popen(
        [*COMMAND, "--json", *map(str, many)], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as running:
        assert running.stdout is not None
        assert running.stderr is not None
        first = running.stdout.readline()
        still_running = running.poll() is None
        running.stdout.close()
        complaints = running.stderr.read()
    assert json.loads(first)["path"] == str(folder / "halves.png")
    assert still_running
    assert complaints == b""
    assert running.returncode == 1


@pytest.mark.nightly
def test_a_network_in_a_file_is_fitted_and_judged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    network = write_classifier(tmp_path / "tiny.onnx")
    lines = (CAPTURE / "capture.jsonl").read_text(encoding="utf-8").splitlines()
    frames = [one for one in map(json.loads, lines) if one.get("truth") in ("wood", "glass")]
    for name in ("wood", "glass"):
        shown = next(one for one in frames if one["truth"] == name and one["type"] == "frame")
        pictures = CAPTURE / shown["file"], "--mask", CAPTURE / shown["mask_file"]
        outcome = recognise(*pictures, "--encoder", network, "--json")
        assert outcome.code == 0, outcome.err
        assert {"wood", "glass"} <= set(outcome.rows[0]["beliefs"])
        assert "of the reference pictures left out; chance is 8%" in outcome.err


def test_texture_maps_are_read_as_surfaces_with_what_the_shader_says(tmp_path: Path) -> None:
    boards = save(tmp_path / "a.png", planks())
    cloth = save(tmp_path / "b.png", weave())
    rows = recognise("--texture", "--json", boards, cloth).rows
    assert [(row["material"], row["source"]) for row in rows] == [
        ("wood", "texture"),
        ("fabric", "texture"),
    ]
    [shaded] = recognise("--texture", "--json", "--metallic", "1", "--roughness", "0.2", cloth).rows
    assert (shaded["material"], shaded["source"]) == ("metal", "shader")


def test_the_region_of_an_atlas_is_read_by_itself(tmp_path: Path) -> None:
    atlas = save(tmp_path / "atlas.png", np.hstack([planks(), weave()]))
    for region, material in (("0,0,0.5,1", "wood"), ("0.5,0,0.5,1", "fabric")):
        [row] = recognise("--texture", "--json", "--region", region, atlas).rows
        assert best(row) == material
