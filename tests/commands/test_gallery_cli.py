"""`hapticvlm gallery`: galleries out of pictures, materials of one's own, and honest checks."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from each_case import each_row
from grounds import drawn
from PIL import Image
from tiny_encoders import Graph, write_onnx
from word_tables import words

from hapticvlm.commands.main import main
from hapticvlm.vision.galleries.calibration import find_confusable_pairs, leave_one_out
from hapticvlm.vision.galleries.enrol import (
    CLOSER,
    Enrolled,
    Picture,
    enrol,
    find_pictures,
    list_pictures,
)
from hapticvlm.vision.galleries.gallery import Calibration, Gallery
from hapticvlm.vision.galleries.storage import SHIPPED, load_gallery, read_gallery
from hapticvlm.vision.galleries.user_materials import read_material
from hapticvlm.vision.loading import load_encoder

COLOURS = {
    "wood": (150, 90, 40),
    "glass": (60, 160, 150),
    "metal": (120, 120, 170),
    "fabric": (190, 30, 60),
}
VIEWS = 2 + len(CLOSER)
WRONG = Path(__file__).with_name("wrong_files.csv")


def photograph(path: Path, colour: tuple[int, int, int], seed: int) -> Path:
    """Save grain around a colour."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    tint = np.array(colour) + rng.normal(0, 10, 3)
    pixels = np.clip(tint + rng.normal(0, 12, (96, 128, 3)), 0, 255).astype(np.uint8)
    Image.fromarray(pixels).save(path, quality=95)
    return path


def collect(folder: Path, count: int = 3, first: int = 0) -> Path:
    """A folder of pictures for each colour."""
    for name, colour in COLOURS.items():
        for seed in range(first, first + count):
            photograph(folder / name / f"{seed}.jpg", colour, seed)
    return folder


@pytest.fixture(scope="module")
def tiny(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An encoder that is not the shipped one and sees only the mean colour."""
    return write_onnx(tmp_path_factory.mktemp("tiny"), Graph())


def gallery(*arguments: object) -> int:
    return main(["gallery", *map(str, arguments)])


def complaint(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """Run a command that must fail; its one line."""
    capsys.readouterr()
    assert gallery(*arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    lines = err.strip().splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("hapticvlm gallery ")
    return lines[0]


def test_a_gallery_is_made_of_a_folder_of_pictures(
    tmp_path: Path, tiny: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pictures, file = collect(tmp_path / "in"), tmp_path / "new" / "my.npz"
    (pictures / "wood" / "again.jpg").write_bytes((pictures / "wood" / "0.jpg").read_bytes())
    assert gallery("build", pictures, "-o", file, "--encoder", tiny) == 0
    said = capsys.readouterr().out
    assert "1 of 13" in said  # a copy counts once
    assert "wood                        3         12  3 of 3" in said
    assert "WARNING" not in said
    assert "12 pictures" in said
    made = load_gallery(file, encoder=load_encoder(str(tiny)))
    assert sorted(made.materials) == sorted(COLOURS)
    assert len(made.labels) == 12 * VIEWS
    assert list(file.parent.iterdir()) == [file]
    assert "`tiny-1`" in complaint(capsys, "list", file, pictures)
    assert "no.npz" in complaint(capsys, "list", tmp_path / "no.npz")
    assert "holds no reference pictures" in complaint(capsys, "list", pictures)


@pytest.mark.nightly
def test_every_gallery_is_calibrated_on_its_own_pictures_beside_the_shipped_ones_if_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pictures, shipped = collect(tmp_path / "in", 2), read_gallery(SHIPPED)
    assert gallery("build", pictures, "-o", tmp_path / "own.npz") == 0
    assert gallery("build", pictures, "-o", tmp_path / "both.npz", "--base", "shipped") == 0
    told = capsys.readouterr().out
    said = re.findall(
        r"of 8 pictures, each left out, .* says (\d) rightly.* says (\d) rightly", told
    )
    assert [int(shipped) for _, shipped in said] == [int(said[0][1])] * 2
    assert int(said[0][0]) > int(said[0][1])  # colours tell these apart, and are no materials
    own, both = read_gallery(tmp_path / "own.npz"), read_gallery(tmp_path / "both.npz")
    assert own.calibration != shipped.calibration == both.calibration
    assert sorted(own.materials) == sorted(COLOURS)
    assert both.materials == shipped.materials
    assert both.user is not None
    assert len(both.user.labels) == 8 * VIEWS


def test_two_materials_with_the_same_pictures_cannot_be_told_apart(
    tmp_path: Path, tiny: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pictures = collect(tmp_path / "in")
    for seed in range(3):
        photograph(pictures / "paper" / f"{seed}.jpg", COLOURS["wood"], seed)
    assert gallery("build", pictures, "-o", tmp_path / "my.npz", "--encoder", tiny) == 0
    (warned,) = [line for line in capsys.readouterr().out.splitlines() if "WARNING" in line]
    assert "paper and wood" in warned
    assert "6 of 6" in warned
    for name, colour in (("wood", "wood"), ("paper", "wood"), ("metal", "metal")):
        photograph(tmp_path / "single" / name / "a.png", COLOURS[colour], 1)
    assert gallery("build", tmp_path / "single", "-o", tmp_path / "single.npz") == 0
    (warned,) = [line for line in capsys.readouterr().out.splitlines() if "WARNING" in line]
    assert "paper and wood" in warned


def test_a_mask_says_where_the_object_is(tmp_path: Path, tiny: Path) -> None:
    encoder = load_encoder(str(tiny))
    pixels = np.zeros((96, 128, 3), np.uint8)
    pixels[:, :] = (10, 200, 10)
    pixels[4:26, 4:34] = (200, 20, 20)
    mask = np.zeros((96, 128), np.uint8)
    mask[4:26, 4:34] = 1
    for folder, place in (("a", "masks/it.png"), ("b", "it.mask.png")):
        home = tmp_path / folder / "wood"
        (home / "masks").mkdir(parents=True)
        Image.fromarray(pixels).save(home / "it.png")
        Image.fromarray(mask).save(home / place)
        (found,) = find_pictures(tmp_path / folder, ["wood"])
        assert found.mask == home / place
        seen = enrol([found], encoder).embeddings
        assert len(seen) == VIEWS
        assert np.allclose(seen @ seen[0], 1.0, atol=1e-3)  # all of the views show red
        plain = enrol([Picture("wood", found.path)], encoder, outline=False).embeddings
        assert float(plain[0] @ seen[0]) < 0.9


def test_a_thing_on_a_plain_ground_is_enrolled_as_if_it_had_a_mask(
    tmp_path: Path, tiny: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pixels, truth = drawn("thing")
    for name in ("wood", "metal"):
        (tmp_path / "in" / name).mkdir(parents=True)
        turned = Image.fromarray(np.roll(pixels, len(name), axis=2))  # another colour
        turned.save(tmp_path / "in" / name / "it.png")
        turned.transpose(Image.Transpose.ROTATE_90).save(tmp_path / "in" / name / "turned.png")
    Image.fromarray(truth).save(tmp_path / "mask.png")
    encoder = load_encoder(str(tiny))
    picture = Picture("wood", tmp_path / "in" / "wood" / "it.png")
    masked = enrol([Picture("wood", picture.path, tmp_path / "mask.png")], encoder)
    outlined, whole = (enrol([picture], encoder, outline=outline) for outline in (True, False))
    assert (masked.outlined, outlined.outlined, whole.outlined) == (0, 1, 0)
    nearness = [float(seen.embeddings[0] @ masked.embeddings[0]) for seen in (outlined, whole)]
    assert nearness[0] > 0.999 > nearness[1]

    options = ("--encoder", tiny, "-o", tmp_path / "my.npz", "--base", "none")
    for switched_off in ([], ["--no-outline"]):
        assert gallery("build", tmp_path / "in", *options, *switched_off) == 0
        assert ("4 of 4 pictures show" in capsys.readouterr().out) == (not switched_off)


def test_a_ring_has_no_closer_views_and_is_enrolled_without(tmp_path: Path, tiny: Path) -> None:
    y, x = np.mgrid[0:96, 0:96]
    ring = np.where(np.abs(np.hypot(y - 48, x - 48) - 45) < 2, 255, 0).astype(np.uint8)
    photograph(tmp_path / "it.png", COLOURS["metal"], 1)
    Image.open(tmp_path / "it.png").crop((0, 0, 96, 96)).save(tmp_path / "it.png")
    Image.fromarray(ring).save(tmp_path / "it.mask.png")
    enrolled = enrol(list_pictures("metal", [tmp_path / "it.png"]), load_encoder(str(tiny)))
    assert 2 <= len(enrolled.embeddings) < VIEWS
    assert np.isfinite(enrolled.embeddings).all()


def test_what_is_wrong_with_pictures_is_said_naming_the_file(
    tmp_path: Path, tiny: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "my.npz"

    def said(folder: Path) -> str:
        return complaint(capsys, "build", folder, "-o", out, "--encoder", tiny)

    assert "nowhere: " in said(tmp_path / "nowhere")
    (tmp_path / "empty").mkdir()
    assert "empty: " in said(tmp_path / "empty")
    loose = collect(tmp_path / "loose", 1)
    photograph(loose / "stray.png", (1, 2, 3), 1)
    assert "stray.png: " in said(loose)
    strange = collect(tmp_path / "strange", 1)
    (strange / "wood").rename(strange / "woood")
    assert {"`woood`", "`wood`"} <= set(re.findall("`[^`]*`", said(strange)))
    bare = collect(tmp_path / "bare", 1)
    (bare / "stone").mkdir()
    assert f"{bare / 'stone'}: " in said(bare)
    for name, data in (("a.jpg", b""), ("b.png", b"\x89PNG\r\n\x1a\n"), ("c.jpg", b"hello")):
        broken = collect(tmp_path / f"broken-{name}", 1)
        (broken / "wood" / name).write_bytes(data)
        assert f"{broken / 'wood' / name}: " in said(broken)
    cut = collect(tmp_path / "cut", 1)
    whole = (cut / "wood" / "0.jpg").read_bytes()
    (cut / "wood" / "0.jpg").write_bytes(whole[: len(whole) // 2])
    assert f"{cut / 'wood' / '0.jpg'}: " in said(cut)
    plain = collect(tmp_path / "plain", 1)
    Image.new("RGB", (64, 64), (90, 90, 90)).save(plain / "wood" / "plain.png")
    assert "plain.png: " in said(plain)
    dark = collect(tmp_path / "dark", 1)
    Image.new("L", (128, 96), 0).save(dark / "wood" / "0.mask.png")
    assert f"{dark / 'wood' / '0.mask.png'}: " in said(dark)
    small = collect(tmp_path / "small", 1)
    Image.new("L", (12, 9), 255).save(small / "wood" / "0.mask.png")
    assert f"{small / 'wood' / '0.mask.png'}: " in (line := said(small))
    assert "12 x 9" in line
    assert not out.exists()


def test_a_gallery_for_another_encoder_takes_enough_pictures_to_calibrate(
    tmp_path: Path, tiny: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pictures = collect(tmp_path / "in", 1)
    said = complaint(capsys, "build", pictures, "-o", tmp_path / "my.npz", "--encoder", tiny)
    assert "`tiny-1`" in said
    arguments = ("build", pictures, "-o", tmp_path / "my.npz", "--encoder", tiny)
    assert "--base" in complaint(capsys, *arguments, "--base", "shipped")


def test_what_cannot_be_written_leaves_what_was_there(
    tmp_path: Path, tiny: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pictures = collect(tmp_path / "in")
    (tmp_path / "taken").write_text("a file")
    said = complaint(capsys, "build", pictures, "-o", tmp_path / "taken", "--encoder", tiny)
    assert "taken: " in said
    assert (tmp_path / "taken").read_text() == "a file"
    (tmp_path / "my.npz").mkdir()
    complaint(capsys, "build", pictures, "-o", tmp_path / "my.npz", "--encoder", tiny)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in", "my.npz", "taken"]


def test_a_material_is_added_with_class_words_facts_and_references(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "gallery"
    shots = [photograph(tmp_path / f"{seed}.jpg", (20, 20, 25), seed) for seed in range(3)]
    facts = ["--set", "thermal.conductivity=1.8", "--set", "vibration.roughness=0.3"]
    words = ["--words", "obsidian,lava glass"]
    arguments = ["obsidian", "--out", folder, "--like", "glass", *words, *facts, *shots]
    assert gallery("add", *arguments) == 0
    said = capsys.readouterr().out
    assert "obsidian                    3         12" in said
    assert f"serve --gallery {folder}" in said
    made = read_material(folder / "obsidian.toml")
    assert (made.like, made.encoder) == ("glass", load_encoder().name)
    assert made.material.words == ("obsidian", "lava glass")
    assert made.material.thermal.conductivity == 1.8
    assert made.references.shape == (3 * VIEWS, load_encoder().dimension)
    assert [path.name for path in folder.iterdir()] == ["obsidian.toml"]
    assert "obsidian" in load_gallery(folder, encoder=load_encoder()).candidates

    assert gallery("list", folder) == 0
    listed = capsys.readouterr().out
    assert "obsidian                 12  your own: like glass;" in listed
    assert "words obsidian, lava glass; thermal.conductivity=1.8; vibration.roughness=0.3" in listed
    missing = tmp_path / "nowhere.jpg"
    said = complaint(capsys, "add", "slate", "--out", folder, "--like", "stone", missing)
    assert f"{missing}: " in said
    again = complaint(capsys, "add", *arguments)
    assert "obsidian.toml: " in again


def test_a_material_added_can_have_its_own_pictures_in_a_build(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, pictures = tmp_path / "gallery", collect(tmp_path / "in", 2)
    shot = photograph(pictures / "obsidian" / "a.jpg", (20, 20, 25), 1)
    refused = complaint(capsys, "build", pictures, "-o", folder)
    assert "`obsidian`" in refused
    assert "gallery add" in refused
    assert gallery("add", "obsidian", shot, "--like", "glass", "--out", folder) == 0
    assert gallery("build", pictures, "-o", folder) == 0
    made = load_gallery(folder, encoder=load_encoder())
    assert "obsidian" in made.materials
    assert int((made.labels == made.materials.index("obsidian")).sum()) == 2 * VIEWS


def test_a_material_and_its_parent_are_no_mistake_for_each_other_in_what_a_build_prints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, pictures = tmp_path / "gallery", collect(tmp_path / "in", 2)
    shots = [photograph(pictures / "burr" / f"{n}.jpg", COLOURS["wood"], n) for n in (5, 6)]
    assert gallery("add", "burr", *shots, "--like", "wood", "--out", folder) == 0
    capsys.readouterr()
    assert gallery("build", pictures, "-o", folder) == 0
    said = capsys.readouterr().out
    assert re.findall(r"^(wood|burr) .* (\d of \d)$", said, re.M) == [
        ("burr", "2 of 2"),
        ("wood", "2 of 2"),
    ]
    assert "WARNING: burr and wood" in said


def test_like_its_class_to_the_last_pixel_is_warned_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, pictures = tmp_path / "gallery", collect(tmp_path / "in", 3)
    assert gallery("build", pictures, "-o", folder) == 0
    capsys.readouterr()
    arguments = ("burr", pictures / "wood", "--like", "wood", "--out", folder)
    assert gallery("add", *arguments) == 0
    (warned,) = [line for line in capsys.readouterr().out.splitlines() if "WARNING" in line]
    assert "burr and wood" in warned
    assert "3 of 3" in warned


@each_row(("arguments", "said"), words(WRONG, "gallery add"))
def test_a_material_that_cannot_be_is_refused_before_anything_is_written(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: str,
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    shot = photograph(tmp_path / "a.jpg", COLOURS["metal"], 1)
    name, *more = arguments.split()
    assert said in complaint(capsys, "add", name, shot, *more)
    assert list(tmp_path.iterdir()) == [shot]


def test_adding_with_another_encoder_is_refused_naming_both(
    tmp_path: Path, tiny: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pictures, folder = collect(tmp_path / "in"), tmp_path / "gallery"
    add = ("slate", pictures / "metal", "--like", "stone", "--out", folder)
    said = complaint(capsys, "add", *add, "--encoder", tiny)
    assert f"{folder}: " in said
    assert "`tiny-1`" in said
    assert not folder.exists()
    assert gallery("build", pictures, "-o", folder, "--encoder", tiny) == 0
    said = complaint(capsys, "add", *add)
    assert {"`tiny-1`", f"`{load_encoder().name}`"} <= set(re.findall("`[^`]*`", said))
    assert gallery("add", *add, "--encoder", tiny) == 0
    said = complaint(capsys, "build", pictures, "-o", folder)
    assert "slate.toml" in said
    assert "`tiny-1`" in said
    assert read_gallery(folder / "gallery.npz").encoder == "tiny-1"


def test_a_gallery_is_tested_on_pictures_it_does_not_hold(
    tmp_path: Path, tiny: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "my.npz"
    assert gallery("build", collect(tmp_path / "in"), "-o", file, "--encoder", tiny) == 0
    others = collect(tmp_path / "others", 4, first=50)
    photograph(others / "unknown" / "x.jpg", (255, 255, 0), 1)
    capsys.readouterr()
    assert gallery("list", file, others, "--encoder", tiny, "--json") == 0
    figures = json.loads(capsys.readouterr().out)["recognised"]
    assert figures["pictures"] == 17
    assert figures["enrolled"] < 5  # this encoder sees little: colours can be the same by chance
    assert figures["materials"]["wood"]["pictures"] == 4
    assert figures["materials"]["wood"]["right"] == 4
    assert figures["materials"]["wood"]["interval"] == [0.5101, 1.0]  # Wilson, 4 of 4
    assert figures["confusion"]["wood"] == {"wood": 4}
    assert set(figures["confusion"]) == {*COLOURS, "unknown"}
    assert gallery("list", file, tmp_path / "in", "--encoder", tiny) == 0
    table = capsys.readouterr().out
    (warned,) = [line for line in table.splitlines() if "WARNING" in line]
    assert "12 of 12" in warned


def enrolled_of(vectors: dict[str, list[list[float]]]) -> Enrolled:
    """One row for each picture, as unit vectors."""
    rows = [row for rows in vectors.values() for row in rows]
    stack = np.array(rows, np.float32)
    stack /= np.linalg.norm(stack, axis=1, keepdims=True)
    shown = [
        Picture(name, Path(f"{n}.png")) for name, rows in vectors.items() for n in range(len(rows))
    ]
    return Enrolled(tuple(shown), stack, np.arange(len(rows)))


def test_left_out_in_turn_a_picture_is_not_compared_with_itself() -> None:
    enrolled = enrolled_of({"wood": [[1, 0, 0], [0, 1, 0]], "glass": [[0.1, 1, 0.2], [0, 1, 0.5]]})
    checked = leave_one_out(enrolled)
    assert checked.guess == ("glass", "glass", "wood", "glass")
    assert (checked.counts("wood", {}), checked.counts("glass", {})) == ((0, 2), (1, 2))
    assert checked.mistaken("wood", "glass") == 2
    (pair,) = find_confusable_pairs(enrolled, checked)
    assert (pair.confused, pair.checked) == (3, 4)


def test_a_picture_that_is_alone_cannot_be_checked_but_a_base_helps() -> None:
    enrolled = enrolled_of({"wood": [[1, 0]], "glass": [[0, 1]]})
    assert leave_one_out(enrolled).guess == (None, None)
    base = Gallery(
        "e", ("wood",), np.array([[1, 0]], np.float32), np.zeros(1, np.int64),
        Calibration(8.0, 8.0, 0.5),
    )  # fmt: skip
    assert leave_one_out(enrolled, base).guess == ("wood", None)


def test_a_mask_of_one_bit_is_read_as_recognise_reads_it(tmp_path: Path) -> None:
    for name in ("wood", "glass"):
        for seed in range(2):
            shot = photograph(tmp_path / "in" / name / f"{seed}.jpg", COLOURS[name], seed)
            with Image.open(shot) as image:
                mask = Image.new("1", image.size, 0)
            mask.paste(1, (10, 10, 40, 40))
            mask.save(shot.with_suffix(".mask.png"))
    assert gallery("build", tmp_path / "in", "-o", tmp_path / "my.npz") == 0
