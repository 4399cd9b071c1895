"""The messages the golden vectors are made of. Values are plain maps, encoded with msgpack."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import msgpack
import msgspec

from hapticvlm.messages import (
    Decision,
    Device,
    Devices,
    Error,
    EvidenceItem,
    LeftOut,
    Limits,
    MessageError,
    Models,
    Ok,
    Ownership,
    Party,
    Privacy,
    ProtocolVersion,
    ServiceMessage,
    SetpointRange,
    Skipped,
    Telemetry,
    Textures,
    Transient,
    Vibration,
    View,
    Welcome,
    decode,
)

Json = dict[str, Any]
HELLO: Json = {
    "type": "hello",
    "id": 1,
    "client": {"name": "unity", "version": "2021.3"},
    "protocol": {"major": 1, "minor": 0},
    "role": "scene",
}
TOUCH: Json = {
    "type": "touch",
    "id": 7,
    "phase": "contact",
    "object_id": "table",
    "hand": "right",
    "speed_mps": 0.25,
    "force_n": 1.5,
    "captured_at": 12.5,
}
FRAME: Json = {
    "type": "frame",
    "id": 9,
    "captured_at": 12.5,
    "format": "rgb8",
    "width": 2,
    "height": 1,
    "origin": "top",
    "image": bytes(range(6)),
}
SCENE: Json = {"type": "scene", "id": 2, "objects": [{"object_id": "a"}], "replace": True}


def client_messages() -> Iterator[tuple[str, Json]]:
    """Yield valid client messages."""
    yield "hello", HELLO
    yield "hello with token, observer", {**HELLO, "role": "observer", "token": "s3cret"}
    yield "hello of a newer minor", {**HELLO, "protocol": {"major": 1, "minor": 7}}
    yield "scene", SCENE
    yield "empty scene", {**SCENE, "objects": []}
    everything = {
        "object_id": "kettle \u00e9\u4e2d\U0001f600",
        "name": "M_BrushedSteel_Kettle",
        "material": "metal",
        "temperature_c": 45.5,
        "shader": {
            "metallic": 1.0,
            "roughness": 0.35,
            "transmission": 0.0,
            "opacity": 0.3,
            "base_color": [0.5, 0.5, 0.25],
        },
        "thickness_m": 0.001,
        "sunlit": True,
    }
    yield "scene with everything", {**SCENE, "objects": [everything], "ambient_c": -5.0}
    hums = {"frequency_hz": 50.0, "level": 0.5, "on": False}
    fridge = {"object_id": "fridge", "vibrates": hums, "stands_on": ["floor"]}
    yield "scene with a thing that hums", {**SCENE, "objects": [fridge]}
    chair = {
        "object_id": "chair",
        "surfaces": [
            {"name": "Oak_Varnished", "shader": {"metallic": 0.0, "roughness": 0.5}},
            {"name": "T_Felt_D.png", "texture": "0123456789abcdef" * 2},
            {"material": "metal"},
            {},
        ],
    }
    yield "scene with surfaces", {**SCENE, "objects": [chair]}
    yield "scene that forgets", {**SCENE, "replace": False, "objects": [], "forget": ["a", "b"]}
    yield "scene of four materials", {**SCENE, "materials": ["wood", "glass", "fabric", "metal"]}
    yield "frame", FRAME
    yield "frame with region", {**FRAME, "region": {"x": 0.25, "y": 0.25, "w": 0.5, "h": 0.5}}
    yield (
        "frame to enrol",
        {**FRAME, "purpose": "enrol", "object_id": "a", "mask": b"\x89PNG", "max_age_ms": 100.0},
    )
    yield "frame of a texture", {**FRAME, "purpose": "texture", "object_id": "a", "surface": 1}
    for phase in ("approach", "contact", "slide", "release"):
        yield f"touch {phase}", {**TOUCH, "phase": phase}
    yield "touch of a surface", {**TOUCH, "surface": 3}
    for interaction in ("tap", "strike", "press", "slide", "carve", "swing"):
        yield f"touch {interaction}", {**TOUCH, "interaction": interaction}
    near = {"phase": "approach", "distance_m": 0.05, "closing_mps": 0.5}
    yield "touch approach, with its distance", {**TOUCH, **near}
    region = {"x": 0.0, "y": 0.0, "w": 1.0, "h": 1.0}
    yield "touch of a region", {**_without(TOUCH, "object_id"), "region": region}
    yield "touch with whole numbers", {**TOUCH, "speed_mps": 0, "force_n": 2, "captured_at": 12}
    yield "set", {"type": "set", "id": 3, "vibration_gain": 0.5, "thermal_gain": 1.0}
    yield "set watch", {"type": "set", "id": 3, "watch": ["frames", "waveform", "log"]}
    forms = {"left": "amplitude", "right": "parametric"}
    yield "set feel", {"type": "set", "id": 3, "feel": forms}
    yield "set ownership", {"type": "set", "id": 3, "ownership": "give"}
    yield "set feel of no hand", {"type": "set", "id": 3, "feel": {}}
    for scope in ("all", "speaker", "peltier"):
        yield f"stop {scope}", {"type": "stop", "id": 4, "scope": scope}


def refused() -> Iterator[Json]:
    """Yield messages the service refuses, with code, path and the id of its error."""
    for name, value in _wrong_values():
        yield _refusal(name, msgpack.packb(value))
        if not _has_bytes(value) and "not a number" not in name:
            yield _refusal(f"{name}, as text", json.dumps(value))
    for name, data in (
        ("nothing", b""),
        ("a truncated map", msgpack.packb(TOUCH)[:-3]),
        ("trailing bytes", msgpack.packb(TOUCH) + b"\x00"),
        ("a declared length of 4 GiB", b"\xdf\xff\xff\xff\xff"),
        ("nested a thousand deep", b"\x81\xa1a" * 1000 + b"\xc0"),
        ("a text that is not UTF-8", b"\x82\xa4type\xa5touch\xa9object_id\xa2\xff\xfe"),
        ("an extension type", b"\x81\xa4type\xd4\x01\x00"),
    ):
        yield _refusal(name, data)
    yield _refusal("a frame as text", json.dumps({**_without(FRAME, "image"), "image": "AAAA"}))
    yield _refusal("broken JSON", '{"type": "touch",')


def service_messages() -> Iterator[tuple[str, ServiceMessage]]:
    """Yield one of each service message, and one of each with optional fields."""
    yield (
        "welcome",
        Welcome(
            id=1,
            service=Party(name="hapticvlm", version="0.1.0"),
            protocol=ProtocolVersion(major=1, minor=0),
            session="00112233aabbccdd",
            owner=True,
            limits=Limits(
                message_bytes=4194304,
                pixels=4096,
                frames_per_s=90.0,
                lease_ms=250,
                setpoint_c=SetpointRange(low=18.0, high=40.0),
            ),
            devices=Devices(
                speaker=Device(name="simulated speaker", simulated=True),
                peltier=Device(name="simulated plate", simulated=True),
            ),
            models=Models(encoder="descriptor", gallery="shipped"),
            materials=["wood", "glass", "fabric", "metal"],
            privacy=Privacy(
                frames_stored=False, frames_leave_machine=False, crops_leave_machine=True
            ),
        ),
    )
    decision = Decision(
        id=0,
        object_id="table",
        material="wood",
        confidence=0.94,
        runner_up="paper",
        source="name",
        cached=False,
        evidence=[EvidenceItem(rung="name", material="wood", confidence=0.94)],
        ambient_c=22.0,
        ambient_low_c=14.0,
        ambient_high_c=30.0,
        ambient_source="default",
        surface_c=22.0,
        surface_low_c=18.0,
        surface_high_c=26.0,
        surface_source="ambient",
        surface_why="as its surroundings",
        contact_c=29.5,
        setpoint_c=29.5,
        unlimited_c=29.5,
        thermal_cue=True,
        pattern="wood strike",
        basis="material",
        feels=["grainy", "knocks"],
        stages_ms={"encode": 2.5},
        frame_age_ms=12.5,
    )
    yield "decision", decision
    cork = msgspec.structs.replace(decision, sub_material="cork", thickness_m=0.005)
    yield "decision on a thing with a sub-material and a thickness", cork
    yield "decision on a surface", msgspec.structs.replace(decision, surface=0)
    yield (
        "decision on an unknown object",
        Decision(
            id=9,
            material="unknown",
            confidence=0.25,
            source="unknown",
            cached=True,
            evidence=[],
            ambient_c=22.0,
            ambient_low_c=14.0,
            ambient_high_c=30.0,
            ambient_source="scene",
            surface_c=22.0,
            surface_low_c=22.0,
            surface_high_c=22.0,
            surface_source="scene",
            surface_why="stated by the scene",
            contact_c=None,
            setpoint_c=32.0,
            unlimited_c=32.0,
            thermal_cue=False,
        ),
    )
    telemetry = Telemetry(
        id=0,
        plate_c=31.5,
        setpoint_c=29.5,
        sink_c=24.0,
        duty=-0.25,
        speaker_level=0.125,
        underruns=0,
        dropped_frames=3,
        leases=1,
        faults=[],
    )
    yield "telemetry", telemetry
    yield "ownership, free", Ownership(id=0, owner=False, free=True)
    yield "ownership, of another", Ownership(id=0, owner=False, free=False)
    yield "textures", Textures(id=0, hashes=["0123456789abcdef0123456789abcdef"])
    yield "skipped", Skipped(id=9, reason="superseded")
    yield "ok", Ok(id=7)
    part = LeftOut(path="objects[3].material", text="left out: no material `porcelain`")
    yield "ok to a scene that was taken in part", Ok(id=7, left_out=[part])
    yield (
        "error",
        Error(id=7, code="limit", text="$.speed_mps: Expected `float` <= 20.0", path="$.speed_mps"),
    )
    yield (
        "vibration",
        Vibration(
            id=0,
            hand="right",
            period_ms=4.0,
            amplitude=[0.5, 0.25],
            frequency_hz=[100.0, 80.0],
            transients=[Transient(at_ms=0.0, amplitude=0.75, frequency_hz=150.0)],
        ),
    )
    plain = Vibration(id=0, hand="left", period_ms=12.5, amplitude=[0.0, 1.0])
    yield "vibration, amplitude alone", plain
    stopped = Vibration(id=0, hand="left", period_ms=12.5, stopped=True)
    yield "vibration that a stop ended", stopped
    waveform = View(id=0, kind="waveform", rate_hz=3000.0, start=120, samples=[0.0, 0.5])
    yield "view of the waveform", waveform
    yield "view of a frame", View(id=0, kind="frames", format="jpeg", image=b"\xff\xd8")


def _wrong_values() -> Iterator[tuple[str, Any]]:
    yield "no type", _without(TOUCH, "type")
    yield "an unknown type", {**TOUCH, "type": "teleport"}
    yield "a list", [1, 2]
    yield "no id", _without(TOUCH, "id")
    yield "id 0", {**TOUCH, "id": 0}
    yield "id true", {**TOUCH, "id": True}
    yield "an unknown field", {**TOUCH, "sped_mps": 1.0}
    yield "a field missing", _without(TOUCH, "speed_mps")
    yield "too fast", {**TOUCH, "speed_mps": 20.5}
    yield "a negative force", {**TOUCH, "force_n": -0.5}
    yield "a speed that is not a number", {**TOUCH, "speed_mps": float("nan")}
    yield "a time that is not a number", {**TOUCH, "captured_at": float("inf")}
    yield "an unknown phase", {**TOUCH, "phase": "hover"}
    yield "an unknown hand", {**TOUCH, "hand": "third"}
    yield "an empty object id", {**TOUCH, "object_id": ""}
    yield "an object id of 129 characters", {**TOUCH, "object_id": "x" * 129}
    yield "a surface beyond the most", {**TOUCH, "surface": 64}
    shouting = {"object_id": "a", "surfaces": [{"texture": "0123456789ABCDEF" * 2}]}
    yield "a texture's hash in capitals", {**SCENE, "objects": [shouting]}
    yield "a region outside", {**TOUCH, "region": {"x": 0.0, "y": 0.0, "w": 1.5, "h": 0.5}}
    yield "a region without height", {**TOUCH, "region": {"x": 0.0, "y": 0.0, "w": 1.0, "h": 0.0}}
    hot = {"object_id": "sun", "temperature_c": 5500.0}
    yield "a temperature outside the range", {**SCENE, "objects": [hot]}
    bare = {"object_id": "a", "shader": {"base_color": [0.5, 0.5]}}
    yield "a colour of two numbers", {**SCENE, "objects": [bare]}
    yield "a scene of no material", {**SCENE, "materials": []}
    yield "an empty id to forget", {**SCENE, "forget": [""]}
    yield "a frame too wide", {**FRAME, "width": 4097}
    yield "a frame without pixels", {**FRAME, "image": b""}
    yield "a frame of an unknown format", {**FRAME, "format": "bmp"}
    yield "an unknown scope", {"type": "stop", "id": 4, "scope": "world"}
    yield "a gain above one", {"type": "set", "id": 3, "vibration_gain": 1.5}
    yield "a distance below nothing", {**TOUCH, "distance_m": -0.01}
    yield "a closing speed too high", {**TOUCH, "closing_mps": 20.5}
    yield "an unknown form to feel", {"type": "set", "id": 3, "feel": {"left": "pcm"}}
    yield "a third hand to feel", {"type": "set", "id": 3, "feel": {"both": "amplitude"}}
    yield "a version that is a text", {**HELLO, "protocol": "1.0"}


def _refusal(name: str, data: bytes | str) -> Json:
    try:
        decode(data)
    except MessageError as error:
        sent = {"msgpack": data.hex()} if isinstance(data, bytes) else {"json": data}
        return {"name": name, **sent, "code": error.code, "path": error.path, "id": error.id}
    raise AssertionError(f"{name} was accepted")


def _without(value: Json, field: str) -> Json:
    return {name: part for name, part in value.items() if name != field}


def _has_bytes(value: Any) -> bool:
    return isinstance(value, dict) and any(isinstance(part, bytes) for part in value.values())
