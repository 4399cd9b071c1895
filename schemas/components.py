"""Builds the draft-07 schema of each message, nested type and choice of values.

msgspec derives the schema from the types of messages.py. This module adds names to choices and
descriptions to fields (meanings.py). It allows unknown fields in types that only the service sends,
so that clients accept a newer minor version.
"""

from __future__ import annotations

import json
from typing import Any, get_args

import msgspec

import meanings
from hapticvlm.messages import ClientMessage, ServiceMessage

Json = dict[str, Any]
# JSON Schema has no type for byte strings, and strict tools refuse keywords that they do not know.
BYTES = "bin: a byte string of MessagePack; JSON messages cannot contain it"


def of_messages(template: str) -> Json:
    """Return the schema of every message, nested type and choice of values, by name.

    `template` is the prefix of a reference.
    """
    kinds = [*get_args(ClientMessage), *get_args(ServiceMessage)]
    _, found = msgspec.json.schema_components(kinds, ref_template=template + "{name}")
    told = _reachable(get_args(ServiceMessage), found)
    asked = _reachable(get_args(ClientMessage), found)
    for name, component in found.items():
        if name in told - asked:
            component.pop("additionalProperties", None)
    tidy: Json = _with_names(_as_draft_7(found), template)
    _describe(tidy)
    said = meanings.of_choices()
    for name, words in meanings.choices().items():
        tidy[name] = {
            "title": name,
            "description": said[name],
            "type": "string",
            "enum": sorted(words),
        }
    return dict(sorted(tidy.items()))


def _describe(components: Json) -> None:
    """Add descriptions to messages and fields; draft-07 requires that a `$ref` has none."""
    kinds, fields = meanings.of_messages(), meanings.of_fields()
    for name, component in components.items():
        component["description"] = kinds[name]
        for key, schema in component["properties"].items():
            if key != "type" and "$ref" not in schema:
                schema["description"] = fields[name][key]


def _with_names(schema: Any, template: str) -> Any:
    """Refer to each choice of values by its name, and write a tag as a constant.

    Type generators then emit `Phase` once instead of a nameless choice at every use.
    """
    if isinstance(schema, list):
        return [_with_names(item, template) for item in schema]
    if not isinstance(schema, dict):
        return schema
    if "enum" in schema:
        words = frozenset(schema["enum"])
        if len(words) == 1:
            return {"type": "string", "const": next(iter(words))}
        (name,) = (name for name, known in meanings.choices().items() if frozenset(known) == words)
        return {"$ref": template + name, **{k: v for k, v in schema.items() if k == "default"}}
    return {name: _with_names(part, template) for name, part in schema.items()}


def _reachable(kinds: tuple[type, ...], components: Json) -> set[str]:
    waiting = [kind.__name__ for kind in kinds]
    found: set[str] = set()
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += [n for n in components if f'/{n}"' in json.dumps(components[name])]
    return found


def _as_draft_7(schema: Any) -> Any:
    """Translate msgspec's output for 2020-12 and OpenAPI into draft-07."""
    if isinstance(schema, list):
        return [_as_draft_7(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    tidy = {name: _as_draft_7(part) for name, part in schema.items() if name != "discriminator"}
    if tidy.pop("contentEncoding", None):
        del tidy["type"]
        tidy["$comment"] = BYTES
        tidy.pop("minLength", None)
        tidy.pop("maxLength", None)
    if "prefixItems" in tidy:
        tidy["items"] = tidy.pop("prefixItems")
        tidy["additionalItems"] = False
    return tidy
