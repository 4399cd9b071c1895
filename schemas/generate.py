"""Writes the schemas and golden vectors from messages.py; `--check` fails when they are stale.

messages.schema.json is JSON Schema draft-07, asyncapi.yaml is AsyncAPI 3.0. vectors/*.json have
messages as bytes, beside their values or the reason of their refusal; vectors/player*.json have
touches and what a player of a feel file makes of them (player_vectors.py), and each client has the
feel files of the built-in materials, with their schema. The WebXR example has a bake of its scene.
The Unity client's message types, and what reads a feel file, are C# (csharp.py).

docs/protocol-reference.md lists every field (tables.py), docs/command-line.md every command and
option, from the parsers (command_line.py), and docs/material-tables.md every material
(material_page.py). Descriptions of messages and fields come from messages.py (meanings.py). A
`$comment` marks byte strings, for which JSON Schema has no type; in the vectors they are
{"$bin": "hex"}.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, get_args

import msgpack
import msgspec
import yaml

import command_line
import components
import csharp
import material_page
import player_vectors
import tables
import vectors
import worklet
from hapticvlm import messages
from hapticvlm.materials import MATERIALS
from hapticvlm.messages import ClientMessage, ServiceMessage
from hapticvlm.rendering.vibration import feel_clips
from hapticvlm.rendering.vibration.vibration import VOICES
from hapticvlm.scenes import bake

HERE = Path(__file__).parent
WEB = HERE.parent / "examples" / "webxr" / "client"
UNITY_FEEL = HERE.parent / "unity_client" / "Runtime" / "Baked" / "Resources" / "HapticVLM"
GODOT = HERE.parent / "examples" / "godot" / "addons" / "hapticvlm"
CLIENTS_OF_CLIPS: dict[str, tuple[Path, ...]] = {
    "true": (WEB, UNITY_FEEL, GODOT),
    "sound": (WEB, UNITY_FEEL),
}
DOCS = HERE.parent / "docs"
UNITY = HERE.parent / "unity_client" / "Runtime" / "Core" / "Generated"
UNITY_FORMAT = HERE.parent / "unity_client" / "Runtime" / "Baked" / "Generated"
Json = dict[str, Any]


def main(arguments: list[str]) -> int:
    """Write all files, or report stale ones with --check."""
    stale = []
    for path, text in generated():
        current = path.read_text(encoding="utf-8") if path.exists() else None
        if current == text:
            continue
        stale.append(path.name)
        if "--check" not in arguments:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
    if stale and "--check" in arguments:
        print(f"stale: {', '.join(stale)}; run `make schemas`", file=sys.stderr)
        return 1
    return 0


def generated() -> Iterator[tuple[Path, str]]:
    """Yield every generated file and its text."""
    yield HERE / "messages.schema.json", _dump(json_schema())
    yield HERE / "asyncapi.yaml", yaml.safe_dump(asyncapi(), sort_keys=False, width=100)
    yield HERE / "vectors" / "accepted.json", _dump(list(accepted()))
    yield HERE / "vectors" / "refused.json", _dump(list(vectors.refused()))
    yield HERE / "vectors" / "answers.json", _dump(list(answers()))
    materials_schema = baked_schema("materials", bake.Materials, bake.VERSION)
    for folder in (HERE, GODOT):
        yield folder / "materials.schema.json", _dump(materials_schema)
    yield WEB / "materials.schema.js", _module(materials_schema, "materials")
    yield HERE / "vectors" / "player.json", _lines(player_vectors.plans())
    yield HERE / "vectors" / "player_sound.json", _lines(player_vectors.sounds())
    yield HERE / "vectors" / "player_hostile.json", _hostile(player_vectors.hostile())
    clips_schema = baked_schema(
        "feel.true.json and feel.sound", feel_clips.Feel, feel_clips.VERSION
    )
    for folder in (HERE, GODOT):
        yield folder / "feel_clips.schema.json", _dump(clips_schema)
    yield WEB / "feel.schema.js", _module(clips_schema, "feel_clips")
    for voice in VOICES:
        clips = feel_clips.encode(feel_clips.feel(MATERIALS, voice)).decode()
        for folder in (HERE / "vectors", *CLIENTS_OF_CLIPS[voice]):
            yield folder / f"feel.{voice}.json", clips
    yield WEB.parent / "materials.json", baked_room(WEB.parent)
    yield WEB / "sound.worklet.js", worklet.one_file(WEB / "sound.processor.js")
    yield UNITY / "Enums.g.cs", csharp.enums(json_schema())
    yield UNITY / "Messages.g.cs", csharp.types(json_schema())
    yield UNITY_FORMAT / "Format.g.cs", csharp.feel_file(clips_schema)
    yield DOCS / "protocol-reference.md", tables.page(json_schema()["$defs"])
    yield DOCS / "command-line.md", command_line.page()
    yield DOCS / "material-tables.md", material_page.page()


def baked_room(folder: Path) -> str:
    """Return the bake of the WebXR example; what was corrected by hand in it stays."""
    scene = messages.decode((folder / "scene.json").read_text(encoding="utf-8"))
    assert isinstance(scene, messages.Scene)
    model = bake.model_of([scene], MATERIALS)
    before = bake.decode((folder / "materials.json").read_bytes())
    return bake.encode(bake.bake(model, MATERIALS, before).materials).decode()


def json_schema() -> Json:
    """Return the schema of everything on the wire."""
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": f"HapticVLM protocol v{messages.PROTOCOL_MAJOR}.{messages.PROTOCOL_MINOR}",
        "$comment": "Generated by schemas/generate.py from service/hapticvlm/messages.py.",
        "oneOf": [{"$ref": "#/$defs/ClientMessage"}, {"$ref": "#/$defs/ServiceMessage"}],
        "$defs": {
            "ClientMessage": _any_of(ClientMessage, "#/$defs/"),
            "ServiceMessage": _any_of(ServiceMessage, "#/$defs/"),
            **components.of_messages("#/$defs/"),
        },
    }


def baked_schema(name: str, kind: type, version: int) -> Json:
    """Return the schema of a file of `hapticvlm bake`."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"HapticVLM {name}.json v{version}",
        "$comment": f"Generated by schemas/generate.py from {kind.__module__}.",
        **_tidy(msgspec.json.schema(kind)),
    }


def _tidy(schema: Any) -> Any:
    """Return the schema with each description as one paragraph."""
    if isinstance(schema, dict):
        return {
            key: " ".join(value.split()) if key == "description" else _tidy(value)
            for key, value in schema.items()
        }
    return schema


def asyncapi() -> Json:
    """Return the AsyncAPI 3 description of the one channel."""
    client = [kind.__name__ for kind in get_args(ClientMessage)]
    service = [kind.__name__ for kind in get_args(ServiceMessage)]
    channel = "#/channels/socket"
    return {
        "asyncapi": "3.0.0",
        "info": {
            "title": "HapticVLM",
            "version": f"{messages.PROTOCOL_MAJOR}.{messages.PROTOCOL_MINOR}.0",
            "description": (
                "Generated by schemas/generate.py. One WebSocket; binary messages are MessagePack "
                "maps, text messages the same maps as JSON. The service answers in the encoding "
                "of `hello`. Requests have an id of at least 1, echoed in the reply; events have "
                "id 0. docs/protocol.md has the rules that a schema cannot express: clocks, "
                "liveness, ownership, stop."
            ),
            "license": {"name": "MIT"},
        },
        "defaultContentType": "application/msgpack",
        "servers": {"local": {"host": "127.0.0.1:8790", "protocol": "ws", "pathname": "/"}},
        "channels": {
            "socket": {
                "title": "The WebSocket",
                "address": "/",
                "messages": {
                    name: {"$ref": f"#/components/messages/{name}"} for name in client + service
                },
            }
        },
        "operations": {
            "fromClient": {
                "action": "receive",
                "channel": {"$ref": channel},
                "messages": [{"$ref": f"{channel}/messages/{name}"} for name in client],
            },
            "fromService": {
                "action": "send",
                "channel": {"$ref": channel},
                "messages": [{"$ref": f"{channel}/messages/{name}"} for name in service],
            },
        },
        "components": {
            "messages": {
                name: {
                    "name": name.lower(),
                    "title": name,
                    "payload": {"$ref": f"#/components/schemas/{name}"},
                }
                for name in client + service
            },
            "schemas": _with_binary(components.of_messages("#/components/schemas/")),
        },
    }


def accepted() -> Iterator[Json]:
    """Yield client messages in both encodings with the value they carry."""
    for name, value in vectors.client_messages():
        yield {"name": name, "msgpack": msgpack.packb(value).hex(), "value": _shown(value)}
        if value["type"] != "frame":
            yield {"name": f"{name}, as text", "json": json.dumps(value), "value": _shown(value)}


def answers() -> Iterator[Json]:
    """Yield service messages: the bytes the service writes, read back with msgpack."""
    for name, message in vectors.service_messages():
        data = messages.encode(message, as_text=False)
        assert isinstance(data, bytes)
        value = msgpack.unpackb(data)
        yield {
            "name": name,
            "msgpack": data.hex(),
            "json": messages.encode(message, as_text=True),
            "value": _shown(value),
        }


def _with_binary(schema: Any) -> Any:
    """Give byte strings the type that AsyncAPI's tools support: base64 in JSON."""
    if isinstance(schema, list):
        return [_with_binary(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    known = (
        {"type": "string", "format": "binary"} if schema.get("$comment") == components.BYTES else {}
    )
    return known | {name: _with_binary(part) for name, part in schema.items()}


def _any_of(union: Any, template: str) -> Json:
    return {"oneOf": [{"$ref": template + kind.__name__} for kind in get_args(union)]}


def _shown(value: Any) -> Any:
    if isinstance(value, bytes):
        return {"$bin": value.hex()}
    if isinstance(value, dict):
        return {name: _shown(part) for name, part in value.items()}
    return [_shown(part) for part in value] if isinstance(value, list) else value


def _dump(value: Any) -> str:
    return json.dumps(value, indent=1, ensure_ascii=True, allow_nan=False) + "\n"


def _module(value: Json, name: str) -> str:
    """Return a JavaScript module: browsers import no JSON yet."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return f"// Generated by schemas/generate.py from {name}.schema.json.\nexport default {text}\n"


def _hostile(cases: Json) -> str:
    lists = (f'"{name}": {_lines(rows).strip()}' for name, rows in cases.items())
    return "{\n" + ",\n".join(lists) + "\n}\n"


def _lines(cases: Iterable[Json]) -> str:
    """Return a list with one case in each line, since the vectors are long rows of numbers."""
    lines = (json.dumps(case, separators=(",", ":"), allow_nan=False) for case in cases)
    return "[\n" + ",\n".join(lines) + "\n]\n"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
