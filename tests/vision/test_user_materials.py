"""Materials of the user's own: read, refused, recognised by word, stated, felt, and served."""

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import peer
from numpy.typing import NDArray
from PIL import Image
from word_tables import words

from hapticvlm.client.local_service import ServiceError, running
from hapticvlm.devices.speaker.engine import AudioSettings, Engine
from hapticvlm.devices.speaker.ring import Ring
from hapticvlm.evidence.ladder import decide, ranked
from hapticvlm.evidence.lexicon import read_lexicon
from hapticvlm.evidence.names import from_name
from hapticvlm.materials import LIMITS, MATERIALS, MaterialError, Mode, derive
from hapticvlm.messages import Scene, SceneObject, Touch
from hapticvlm.rendering.heat import contact as thermal
from hapticvlm.rendering.vibration.impacts import impact
from hapticvlm.rendering.vibration.textures import Texture
from hapticvlm.rendering.vibration.vibration import IMPACTS, TEXTURES, Motion
from hapticvlm.rendering.vibration.voices import Command, Voices
from hapticvlm.session.actions import PlayVibration, Reply
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings
from hapticvlm.vision.galleries.enrol import enrol, list_pictures
from hapticvlm.vision.galleries.user_materials import (
    MAX_USER_MATERIALS,
    UserMaterial,
    read_folder,
    read_material,
    table_with,
)
from hapticvlm.vision.galleries.user_materials import write_material as write
from hapticvlm.vision.loading import load_encoder

pytestmark = pytest.mark.process

STROKE = Motion(0.3, 1.5)
OBSIDIAN = """
like = "glass"
words = ["obsidian", "lava glass"]

[thermal]
conductivity = 1.8

[vibration]
roughness = 0.3
modes = [{ frequency_hz = 300, decay_per_s = 60, gain = 1.0 }]
"""


def own(text: str, folder: Path, name: str = "obsidian") -> UserMaterial:
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return read_material(path)


def test_facts_that_are_not_given_are_those_of_the_class(tmp_path: Path) -> None:
    made = own(OBSIDIAN, tmp_path).material
    glass = MATERIALS["glass"]
    assert made.thermal == replace(glass.thermal, conductivity=1.8)
    assert made.vibration.modes == (Mode(300.0, 60.0, 1.0),)
    assert made.vibration.roughness == 0.3
    assert made.vibration.pitch_m == glass.vibration.pitch_m
    assert made.words == ("obsidian", "lava glass")


def test_a_class_alone_is_enough_and_the_name_is_the_word(tmp_path: Path) -> None:
    made = own('like = "wood"', tmp_path, "burr-walnut").material
    assert (made.thermal, made.vibration) == (
        MATERIALS["wood"].thermal,
        MATERIALS["wood"].vibration,
    )
    assert made.words == ("burr walnut",)
    assert own('like = "wood"', tmp_path, "sample7").material.words == ()
    assert own('like = "wood"\nwords = []', tmp_path, "walnut").material.words == ()


def test_a_material_comes_back_as_it_was_written(tmp_path: Path) -> None:
    facts = {
        "thermal": {"conductivity": 0.2, "density": 700},
        "vibration": {"modes": [{"frequency_hz": 90, "decay_per_s": 70.5, "gain": 1}]},
    }
    references = np.eye(3, 8, dtype=np.float32)
    made = UserMaterial(
        derive("nussbaum", "wood", ["nußbaum", "walnut"], facts),
        "wood",
        facts,
        'a "b" \\',
        references,
    )
    back = read_material(write(made, tmp_path))
    assert (back.material, back.like, back.encoder) == (made.material, "wood", 'a "b" \\')
    assert back.facts == facts
    assert np.array_equal(back.references, references)
    assert [path.name for path in tmp_path.iterdir()] == ["nussbaum.toml"]


WRONG = words(Path(__file__).with_name("wrong_materials.csv"), "wrong")


@pytest.mark.parametrize(("text", "complaint", "cure"), WRONG)
def test_an_error_in_a_file_is_reported_with_file_field_and_cure(
    tmp_path: Path, text: str, complaint: str, cure: str
) -> None:
    with pytest.raises(MaterialError) as caught:
        own(text, tmp_path)
    said = str(caught.value)
    assert said.startswith(f"{tmp_path / 'obsidian.toml'}: ")
    assert complaint in said
    assert cure in said
    assert "\n" not in said


def test_a_name_is_of_few_letters_and_not_built_in() -> None:
    taken = dict.fromkeys(("wood", "unknown"), "built in; choose another name")
    odd = dict.fromkeys(("Obsidian", "a b", "ob.sidian", "ö", "", "x" * 41), "name: .* rename it")
    for name, said in {**taken, **odd}.items():
        with pytest.raises(MaterialError, match=said):
            derive(name, "glass")


def test_a_folder_holds_a_limited_number_and_hidden_files_do_not_count(tmp_path: Path) -> None:
    for number in range(MAX_USER_MATERIALS):
        own('like = "wood"', tmp_path, f"kind-{number}")
    (tmp_path / ".draft.toml").write_text("nothing")
    (tmp_path / "notes.txt").write_text("nothing")
    assert len(read_folder(tmp_path)) == MAX_USER_MATERIALS
    own('like = "wood"', tmp_path, "one-more")
    with pytest.raises(MaterialError, match=f"at most {MAX_USER_MATERIALS}"):
        read_folder(tmp_path)
    assert read_folder(None) == ()
    assert read_folder(tmp_path / "nowhere") == ()


def corners() -> list[dict[str, Any]]:
    """Facts at their limits: all lowest, all highest, and soft things that conduct."""
    found = []
    for side in (0, 1):
        facts: dict[str, Any] = {"thermal": {}, "vibration": {}}
        mode: dict[str, float] = {}
        for path, limits in LIMITS.items():
            part, *inner = path.split(".")
            (mode if len(inner) == 2 else facts[part])[inner[-1]] = limits[side]
        facts["vibration"]["modes"] = [mode] * (1 if side else 8)
        found.append(facts)
    return found


@pytest.mark.parametrize("facts", corners())
def test_facts_at_their_limits_give_finite_heat_and_sound(facts: dict[str, Any]) -> None:
    extreme = derive("extreme", "metal", None, facts)
    for surface_c in (-40.0, 20.0, 200.0):
        contact = thermal.thermal_contact(extreme.thermal, surface_c, thickness_m=0.001)
        assert math.isfinite(thermal.contact_temperature_c(contact))
        for seconds in (0.0, 0.1, 10.0):
            assert math.isfinite(thermal.skin_surface_c(contact, seconds))
    for speed_mps in (0.0, 0.05, 20.0):
        motion = Motion(speed_mps, 5.0)
        for kind in IMPACTS:
            wave = impact(extreme.vibration, kind, motion, 1)
            assert np.abs(wave).max() <= 1.0
        for kind in TEXTURES:
            assert np.isfinite(Texture(extreme.vibration, kind, 1).render(4800, motion)).all()


@pytest.fixture
def table(tmp_path: Path) -> dict[str, Any]:
    own(OBSIDIAN, tmp_path)
    own('like = "wood"\nwords = ["walnut"]', tmp_path, "burr")
    return dict(table_with(read_folder(tmp_path)))


def test_the_built_in_table_stays_as_it_is(table: dict[str, Any]) -> None:
    assert list(table) == [*MATERIALS, "burr", "obsidian"]
    assert "obsidian" not in MATERIALS
    with pytest.raises(TypeError):
        MATERIALS["obsidian"] = table["obsidian"]  # type: ignore[index]


def test_its_words_in_names_come_before_the_built_in_ones(table: dict[str, Any]) -> None:
    lexicon = read_lexicon(table)

    def said(name: str) -> str | None:
        evidence = from_name(name, lexicon)
        return evidence.material if evidence else None

    assert said("ObsidianShard_02") == "obsidian"
    assert said("lava_glass_vase") == "obsidian"
    assert said("obsidiantable") == "obsidian"
    assert said("glass_vase") == "glass"
    assert said("walnut_desk") == "burr"
    assert said("oak_desk") == "wood"
    assert said("table with obsidian top") != "obsidian"
    plain = from_name("walnut_desk")
    assert plain is not None
    assert plain.material == "wood"
    assert from_name("ObsidianShard_02") is None


def test_a_word_of_two_materials_is_shared(tmp_path: Path) -> None:
    own('like = "wood"\nwords = ["burl"]', tmp_path, "one")
    own('like = "wood"\nwords = ["burl"]', tmp_path, "other")
    evidence = from_name("burl", read_lexicon(table_with(read_folder(tmp_path))))
    assert evidence is not None
    assert {name for name, _ in evidence.beliefs} == {"one", "other"}
    assert evidence.confidence < 0.5


def test_a_child_takes_nothing_from_its_parent_until_it_is_known_by_itself(
    table: dict[str, Any],
) -> None:
    def said(**beliefs: float) -> tuple[str, float]:
        verdict = decide([ranked("encoder", beliefs)], table)
        return verdict.material, round(verdict.confidence, 2)

    assert said(wood=0.4, burr=0.35, metal=0.1) == ("wood", 0.75)
    assert said(wood=0.2, burr=0.55, metal=0.1) == ("burr", 0.55)
    assert said(wood=0.2, burr=0.2, metal=0.45)[0] == "unknown"
    assert said(glass=0.1, obsidian=0.3, metal=0.45)[0] == "unknown"


def test_a_name_of_two_children_is_felt_as_their_parent(tmp_path: Path) -> None:
    own('like = "wood"\nwords = ["burl"]', tmp_path, "one")
    own('like = "wood"\nwords = ["burl"]', tmp_path, "other")
    table = dict(table_with(read_folder(tmp_path)))
    assert decision_of(session_with(table, name="burl")[1]).material == "wood"


def session_with(table: dict[str, Any], **facts: Any) -> tuple[SceneSession, list[Any]]:
    session = SceneSession(SessionSettings(owner=True, table=table))
    objects = [SceneObject(object_id="thing", **facts)]
    actions = session.receive(Scene(id=1, objects=objects, replace=True, ambient_c=20.0), 0.0)
    touch = Touch(
        id=2, phase="contact", captured_at=0.0, hand="left", speed_mps=0.3, force_n=1.0,
        object_id="thing",
    )  # fmt: skip
    return session, [*actions, *session.receive(touch, 0.1)]


def decision_of(actions: list[Any]) -> Any:
    return next(
        a.message for a in actions if isinstance(a, Reply) and hasattr(a.message, "contact_c")
    )


def test_a_stated_material_is_felt_with_its_own_facts(table: dict[str, Any]) -> None:
    _, actions = session_with(table, material="obsidian")
    decision = decision_of(actions)
    expected = thermal.contact_temperature_c(
        thermal.thermal_contact(table["obsidian"].thermal, 20.0)
    )
    glass = thermal.contact_temperature_c(thermal.thermal_contact(MATERIALS["glass"].thermal, 20.0))
    assert (decision.material, decision.source) == ("obsidian", "scene")
    assert decision.contact_c == pytest.approx(expected)
    assert abs(decision.contact_c - glass) > 0.5
    assert next(a.command.material for a in actions if isinstance(a, PlayVibration)) == "obsidian"


def test_an_unknown_material_is_an_error_naming_the_nearest_own_one(table: dict[str, Any]) -> None:
    with pytest.raises(Exception, match="nearest is `obsidian`") as caught:
        session_with(table, material="obsidan")
    assert "burr" in str(caught.value)
    with pytest.raises(Exception, match="no material `obsidian`"):
        session_with(dict(MATERIALS), material="obsidian")


def command(material: str, *, onset: bool, seed: int = 3) -> Command:
    return Command(0, material, "strike" if onset else "slide", onset, STROKE, seed, math.inf)


def played(voices: Voices | Engine, count: int = 4800) -> NDArray[np.float32]:
    return voices.render(count, 0.0) if isinstance(voices, Voices) else voices.fill(count)


def test_an_own_material_sounds_like_itself_and_without_facts_like_its_class(
    table: dict[str, Any],
) -> None:
    waves = {}
    for name in ("obsidian", "glass", "burr", "wood"):
        voices = Voices(table=table)
        voices.apply(command(name, onset=True))
        waves[name] = played(voices)
        assert np.abs(waves[name]).max() > 0.01
    assert np.array_equal(waves["burr"], waves["wood"])
    assert not np.allclose(waves["obsidian"], waves["glass"], atol=0.01)


def test_the_ring_counts_materials_by_the_table_it_was_made_with(table: dict[str, Any]) -> None:
    ring = Ring.create(list(table))
    engine = Engine(ring, AudioSettings(materials=tuple(table.values())))
    for name in table:
        ring.put(command(name, onset=False), 0.0)
    far = Ring(ring.shared, list(table))
    orders = [order for _, _, order in far.take(0)]
    assert [order.material for order in orders if isinstance(order, Command)] == list(table)
    ring.put(command("obsidian", onset=True), 0.0)
    assert np.abs(played(engine)).max() > 0.01
    with pytest.raises(ValueError, match="not in tuple"):
        Ring.create().put(command("obsidian", onset=True), 0.0)


def photograph(path: Path) -> Path:
    """Save coarse coloured noise: like nothing that was ever enrolled."""
    cells = np.random.default_rng(7).integers(0, 255, (14, 14, 3), np.uint8)
    Image.fromarray(cells).resize((224, 224)).save(path, quality=92)
    return path


def gallery_folder(folder: Path) -> Path:
    """One own material with one picture, colder to the touch than the class it is like."""
    facts = {"thermal": {"conductivity": 40.0}, "vibration": {"roughness": 0.9}}
    slate = derive("night-slate", "wood", ["nightslate"], facts)
    encoder = load_encoder()
    seen = enrol(list_pictures("night-slate", [photograph(folder / "slate.jpg")]), encoder)
    write(UserMaterial(slate, "wood", facts, encoder.name, seen.embeddings), folder)
    return folder


async def test_a_service_with_a_gallery_folder_knows_the_material_through_and_through(
    tmp_path: Path,
) -> None:
    gallery_folder(tmp_path)
    with running(["--gallery", str(tmp_path)]) as service:
        async with peer(service) as client:
            welcome = await client.hello()
            assert welcome["materials"] == [*MATERIALS, "night-slate"]
            assert welcome["models"]["gallery"] == tmp_path.name
            objects = [
                {"object_id": "slab", "material": "night-slate"},
                {"object_id": "plank", "material": "wood"},
                {"object_id": "nightslate_tile"},
            ]
            await client.ask(type="scene", objects=objects, ambient_c=15.0, replace=True)
            felt = {}
            for thing in ("plank", "slab", "nightslate_tile"):
                await client.touch("contact", thing)
                await client.touch("slide", thing)
                felt[thing] = await client.event("decision", object_id=thing)
                assert await loudest(client, thing) > 0.005
                await client.touch("release")
            assert (felt["slab"]["material"], felt["slab"]["source"]) == ("night-slate", "scene")
            assert felt["nightslate_tile"]["material"] == "night-slate"
            assert felt["nightslate_tile"]["source"] == "name"
            colder = felt["plank"]["contact_c"] - felt["slab"]["contact_c"]
            assert colder > 5.0
            picture = {"format": "jpeg", "width": 224, "height": 224, "origin": "top"}
            seen = await client.ask(
                type="frame",
                captured_at=time.monotonic(),
                object_id="thing",
                image=(tmp_path / "slate.jpg").read_bytes(),
                **picture,
            )
            assert (seen["material"], seen["source"]) == ("night-slate", "encoder")
            wrong = [{"object_id": "x", "material": "night-slat"}]
            taken = await client.ask(type="scene", objects=wrong, replace=False)
            (part,) = taken["left_out"]
            assert part["path"] == "objects[0].material"
            assert "nearest is `night-slate`" in part["text"]
        assert service.stop() == 0


async def loudest(client: Any, thing: str) -> float:
    """The highest speaker level told while a hand keeps rubbing."""
    level = 0.0
    for _ in range(6):
        await client.touch("slide", thing)
        level = max(level, (await client.telemetry())["speaker_level"])
    return level


def test_a_broken_material_is_reported_in_one_line_at_start(tmp_path: Path) -> None:
    (tmp_path / "slate.toml").write_text('like = "stone"\n[thermal]\nconductivity = -2\n')
    with pytest.raises(ServiceError) as caught, running(["--gallery", str(tmp_path)]):
        pass
    said = str(caught.value).strip()
    assert "slate.toml: thermal.conductivity: -2 is not a number within" in said
    assert len(said.splitlines()) == 1
