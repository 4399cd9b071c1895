"""Writes the scene and the prefabs of Samples~/Mouse as Unity's text format; `--check` compares.

Scripts and prefabs are referenced by the GUIDs of their .meta files (metas.py), meshes and the
material by the editor's built-in ones. Supports only the few components used here.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import metas

FOLDER = metas.PACKAGE / "Samples~" / "Mouse"
HEAD = "%YAML 1.1\n%TAG !u! tag:unity3d.com,2011:\n"
BUILT_IN = "guid: 0000000000000000{}000000000000000, type: 0"
CUBE, SPHERE = 10202, 10207
THINGS = ("OakTable", "WindowGlass", "WoolCurtain", "SteelKettle")
AMBIENT = "  m_AmbientMode: 3\n  m_AmbientSkyColor: {r: 0.5, g: 0.5, b: 0.5, a: 1}\n"
SETTINGS = ((29, "OcclusionCullingSettings"), (104, "RenderSettings"), (157, "LightmapSettings"))


@dataclass(frozen=True)
class Part:
    """One component: Unity's class number and name, and its fields as lines."""

    number: int
    name: str
    fields: tuple[str, ...] = ()


def main(arguments: list[str]) -> int:
    """Write all files, or with --check fail when one is stale."""
    stale = [path for path, text in files() if not metas.is_current(path, text)]
    if "--check" in arguments:
        return len(stale)
    for path, text in files():
        path.write_text(text, encoding="utf-8")
    return 0


def files() -> Iterator[tuple[Path, str]]:
    """Yield each file and its text."""
    yield FOLDER / "Haptic Client.prefab", HEAD + thing(1000, "Haptic Client", client())
    yield FOLDER / "Mouse Hand.prefab", HEAD + thing(1000, "Mouse Hand", hand(), scale=0.04)
    yield FOLDER / "Mouse.unity", scene()


def scene() -> str:
    """Return the scene: camera, light, four objects to touch, and the two prefabs."""
    text = HEAD
    for at, (number, name) in enumerate(SETTINGS, 1):
        text += f"--- !u!{number} &{at}\n{name}:\n  m_ObjectHideFlags: 0\n"
        text += AMBIENT if name == "RenderSettings" else ""
    text += thing(100, "Main Camera", camera(), position=(0.0, 1.3, -1.2), tag="MainCamera")
    text += thing(
        200, "Light", light(), position=(0.0, 3.0, 0.0), rotation=(0.408, -0.235, 0.109, 0.875)
    )
    for at, name in enumerate(THINGS):
        place = (0.4 * at - 0.6, 1.2, 0.0)
        text += thing(300 + 10 * at, name, touchable(), position=place, scale=0.25)
    text += prefab(900, "Haptic Client.prefab", (0.0, 0.0, 0.0))
    return text + prefab(901, "Mouse Hand.prefab", (0.0, 1.3, -0.4))


def thing(
    number: int,
    name: str,
    parts: tuple[Part, ...],
    *,
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0),
    scale: float = 1.0,
    tag: str = "Untagged",
) -> str:
    """Return a game object and its components; file ids count up from `number`."""
    place = (
        f"m_LocalRotation: {vector(rotation)}",
        f"m_LocalPosition: {vector(position)}",
        f"m_LocalScale: {vector((scale,) * 3)}",
        "m_Children: []",
        "m_Father: {fileID: 0}",
    )
    whole = (Part(4, "Transform", place), *parts)
    lines = [
        f"--- !u!1 &{number}",
        "GameObject:",
        "  m_ObjectHideFlags: 0",
        "  serializedVersion: 6",
    ]
    lines += ["  m_Component:"]
    lines += [f"  - component: {{fileID: {number + at}}}" for at in range(1, len(whole) + 1)]
    lines += ["  m_Layer: 0", f"  m_Name: {name}", f"  m_TagString: {tag}", "  m_IsActive: 1"]
    for at, part in enumerate(whole, 1):
        lines += [f"--- !u!{part.number} &{number + at}", f"{part.name}:", "  m_ObjectHideFlags: 0"]
        lines += [f"  m_GameObject: {{fileID: {number}}}", *(f"  {line}" for line in part.fields)]
    return "\n".join(lines) + "\n"


def prefab(number: int, file: str, position: tuple[float, float, float]) -> str:
    """Return an instance of a prefab of this folder; its transform there has the file id 1001."""
    guid = metas.guid(FOLDER / file)
    lines = [f"--- !u!1001 &{number}", "PrefabInstance:", "  m_ObjectHideFlags: 0"]
    lines += ["  serializedVersion: 2", "  m_Modification:", "    m_TransformParent: {fileID: 0}"]
    lines += ["    m_Modifications:"]
    for axis, value in zip("xyz", position, strict=True):
        lines += [f"    - target: {{fileID: 1001, guid: {guid}, type: 3}}"]
        lines += [f"      propertyPath: m_LocalPosition.{axis}", f"      value: {value}"]
        lines += ["      objectReference: {fileID: 0}"]
    lines += ["    m_RemovedComponents: []"]
    lines += [f"  m_SourcePrefab: {{fileID: 100100000, guid: {guid}, type: 3}}"]
    return "\n".join(lines) + "\n"


def vector(values: tuple[float, ...]) -> str:
    """Return a vector in Unity's braces."""
    pairs = zip("xyzw", values, strict=False)
    return "{" + ", ".join(f"{axis}: {value:g}" for axis, value in pairs) + "}"


def script(path: str, *fields: str) -> Part:
    """Return a component of a script of this package, with its non-default fields."""
    guid = metas.guid(metas.PACKAGE / path)
    reference = f"m_Script: {{fileID: 11500000, guid: {guid}, type: 3}}"
    return Part(114, "MonoBehaviour", ("m_Enabled: 1", "m_EditorHideFlags: 0", reference, *fields))


def mesh(number: int) -> tuple[Part, Part]:
    """Return the components that draw a built-in mesh in the built-in material."""
    shape = f"m_Mesh: {{fileID: {number}, {BUILT_IN.format('e')}}}"
    paint = f"- {{fileID: 10303, {BUILT_IN.format('f')}}}"
    drawn = ("m_Enabled: 1", "m_CastShadows: 1", "m_ReceiveShadows: 1", "m_Materials:", paint)
    return Part(33, "MeshFilter", (shape,)), Part(23, "MeshRenderer", drawn)


def client() -> tuple[Part, ...]:
    """Return the components of the client prefab."""
    return (script("Runtime/Unity/HapticClient.cs"),)


def hand() -> tuple[Part, ...]:
    """Return the components of the hand prefab: a visible ball moved by the mouse."""
    ball = (
        "m_IsTrigger: 1",
        "m_Enabled: 1",
        "serializedVersion: 2",
        "m_Radius: 0.5",
        "m_Center: {x: 0, y: 0, z: 0}",
    )
    body = ("serializedVersion: 2", "m_Mass: 1", "m_UseGravity: 0", "m_IsKinematic: 1")
    feeling = script("Runtime/Unity/HapticHand.cs", "hand: 2", "approachM: 0.2")
    moving = script("Samples~/Mouse/MouseHand.cs", "metresPerSecond: 0.8")
    return (
        *mesh(SPHERE),
        Part(135, "SphereCollider", ball),
        Part(54, "Rigidbody", body),
        feeling,
        moving,
    )


def touchable() -> tuple[Part, ...]:
    """Return the components of a cube that can be felt."""
    box = (
        "m_IsTrigger: 0",
        "m_Enabled: 1",
        "serializedVersion: 2",
        "m_Size: {x: 1, y: 1, z: 1}",
        "m_Center: {x: 0, y: 0, z: 0}",
    )
    return (*mesh(CUBE), Part(65, "BoxCollider", box), script("Runtime/Unity/HapticObject.cs"))


def camera() -> tuple[Part, ...]:
    """Return the components of the camera."""
    seen = (
        "m_Enabled: 1",
        "serializedVersion: 2",
        "m_ClearFlags: 1",
        "m_BackGroundColor: {r: 0.2, g: 0.3, b: 0.4, a: 0}",
        "m_NormalizedViewPortRect:",
        *("  serializedVersion: 2", "  x: 0", "  y: 0", "  width: 1", "  height: 1"),
        "near clip plane: 0.05",
        "far clip plane: 100",
        "field of view: 60",
        "orthographic: 0",
        "m_Depth: -1",
        *("m_CullingMask:", "  serializedVersion: 2", "  m_Bits: 4294967295"),
    )
    return (Part(20, "Camera", seen), Part(81, "AudioListener", ("m_Enabled: 1",)))


def light() -> tuple[Part, ...]:
    """Return the components of a sun."""
    shining = (
        "m_Enabled: 1",
        "serializedVersion: 10",
        "m_Type: 1",
        "m_Color: {r: 1, g: 1, b: 1, a: 1}",
        "m_Intensity: 1",
        *("m_CullingMask:", "  serializedVersion: 2", "  m_Bits: 4294967295"),
        "m_Lightmapping: 4",
    )
    return (Part(108, "Light", shining),)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
