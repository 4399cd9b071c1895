"""The sample scene: its references resolve, and the mouse touches its objects in play mode."""

import re
import subprocess
import sys

import pytest
import yaml
from mono import PACKAGE

from hapticvlm.client.local_service import running

pytest_plugins = ("mono_build",)
FOLDER = PACKAGE / "Samples~" / "Mouse"
BUILT_IN = re.compile(r"0000000000000000[ef]000000000000000")


def documents(path):
    """Return the parts of a scene or prefab by file id: (name, fields)."""
    parts = re.split(r"^--- !u!\d+ &(\d+)\n", path.read_text(), flags=re.MULTILINE)[1:]
    loaded = {
        int(at): yaml.safe_load(text) for at, text in zip(parts[::2], parts[1::2], strict=True)
    }
    return {at: next(iter(part.items())) for at, part in loaded.items()}


def guids():
    metas = [*PACKAGE.rglob("*.meta")]
    found = ((re.findall(r"^guid: (\w+)", path.read_text(), re.M), path) for path in metas)
    return {guid: path.with_suffix("") for (guid,), path in found}


def references(value):
    """Yield every reference of a part: file id and GUID, if it has one."""
    if isinstance(value, dict):
        if "fileID" in value:
            yield value["fileID"], value.get("guid")
        for inner in value.values():
            yield from references(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from references(inner)


@pytest.mark.parametrize("name", ["Mouse.unity", "Mouse Hand.prefab", "Haptic Client.prefab"])
def test_every_reference_of_a_sample_file_leads_somewhere(name):
    known, parts = guids(), documents(FOLDER / name)
    for _, fields in parts.values():
        for file_id, guid in references(fields):
            if guid is None:
                assert file_id == 0 or file_id in parts
            else:
                assert BUILT_IN.fullmatch(str(guid)) or guid in known


def test_every_field_of_a_sample_file_is_one_of_its_script():
    for name in ("Mouse.unity", "Mouse Hand.prefab"):
        for kind, fields in documents(FOLDER / name).values():
            if kind != "MonoBehaviour":
                continue
            source = guids()[fields["m_Script"]["guid"]].read_text()
            for field in fields:
                assert field.startswith("m_") or re.search(rf"\b{field}\b( =.*)?;", source), field


def test_the_sample_files_are_what_the_script_writes():
    script = PACKAGE / "Tools~" / "sample_scene.py"
    subprocess.run([sys.executable, str(script), "--check"], check=True, timeout=60)


def lines(parts, moved=None):
    """Return a scene or prefab as the lines that components/SampleScene.cs reads."""
    scripts = guids()
    for kind, fields in parts.values():
        if kind == "PrefabInstance":
            path = scripts[fields["m_SourcePrefab"]["guid"]]
            changes = fields["m_Modification"]["m_Modifications"]
            yield from lines(documents(path), [change["value"] for change in changes])
        if kind != "GameObject":
            continue
        whole = [parts[each["component"]["fileID"]] for each in fields["m_Component"]]
        place = whole[0][1]
        position = moved or list(place["m_LocalPosition"].values())
        scale = place["m_LocalScale"]["x"]
        named = [fields["m_Name"], fields["m_TagString"]]
        yield "\t".join(["thing", *named, *map(str, [*position, scale])])
        for name, part in whole[1:]:
            is_script = name == "MonoBehaviour"
            yield f"part\t{scripts[part['m_Script']['guid']].stem if is_script else name}"
            for field, value in part.items():
                yield f"field\t{field}\t{value}"


def test_pressed_play_the_sample_is_felt_by_the_mouse(build):
    text = "\n".join(lines(documents(FOLDER / "Mouse.unity"))) + "\n"
    with running() as service:
        samples = str(build.folder / "samples.dll")
        output = build.run("components.exe", "mouse", service.url, samples, text=text)
    for name, material in (
        ("OakTable", "wood"),
        ("WindowGlass", "glass"),
        ("WoolCurtain", "fabric"),
        ("SteelKettle", "metal"),
    ):
        assert f"screen {name}: {material}, by Name" in output, output
    shown = "OakTable: wood, by Name"
    assert shown in output
    assert shown in (PACKAGE / "README.md").read_text()
    assert "exceptions 0" in output
    assert "threads left 0" in output
