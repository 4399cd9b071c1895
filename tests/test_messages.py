"""Tests the wire format: golden vectors, the published schema, hostile bytes."""

import importlib
import json
from pathlib import Path

import jsonschema
import msgpack
import msgspec
import pytest
from each_case import each

from hapticvlm.messages import ClientMessage, MessageError, ServiceMessage, decode, encode

ROOT = Path(__file__).parents[1]
SCHEMA = json.loads((ROOT / "schemas/messages.schema.json").read_text())


def vectors(name):
    return json.loads((ROOT / f"schemas/vectors/{name}.json").read_text())


def with_bytes(value):
    if isinstance(value, dict):
        if value.keys() == {"$bin"}:
            return bytes.fromhex(value["$bin"])
        return {name: with_bytes(part) for name, part in value.items()}
    return [with_bytes(part) for part in value] if isinstance(value, list) else value


def sent(vector):
    return bytes.fromhex(vector["msgpack"]) if "msgpack" in vector else vector["json"]


@each(vector=vectors("accepted"))
def test_an_accepted_vector_decodes_to_its_value(vector):
    expected = msgspec.convert(with_bytes(vector["value"]), ClientMessage)
    assert decode(sent(vector)) == expected


@each(vector=vectors("refused"))
def test_a_refused_vector_gives_its_code_path_and_id(vector):
    with pytest.raises(MessageError) as refused:
        decode(sent(vector))
    error = refused.value
    assert (error.code, error.path, error.id) == (vector["code"], vector["path"], vector["id"])
    assert ";" in error.text, "an error says what to do"


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ({"type": "set", "ownership": "borrow"}, "`ownership` is one of take, give, end"),
        ({"type": "stop", "scope": "none"}, "`scope` is one of all, speaker, peltier"),
        ({"type": "shout"}, "`type` is one of hello, scene, frame, touch, set, stop"),
    ],
)
def test_a_refusal_names_the_words_that_may_stand_there(message, words):
    with pytest.raises(MessageError, match=words):
        decode(json.dumps({"id": 1, **message}))


@each(vector=vectors("answers"))
def test_an_answer_is_read_by_another_implementation_and_written_byte_for_byte(vector):
    data = bytes.fromhex(vector["msgpack"])
    assert msgpack.unpackb(data) == with_bytes(vector["value"])
    message = msgspec.msgpack.decode(data, type=ServiceMessage)
    assert encode(message, as_text=False) == data
    assert encode(message, as_text=True) == vector["json"]


@each(vector=vectors("accepted") + vectors("answers"))
def test_the_published_schema_accepts_what_the_service_speaks(vector):
    jsonschema.Draft7Validator(SCHEMA).validate(with_bytes(vector["value"]))


def test_the_published_schema_refuses_what_the_service_refuses():
    validator = jsonschema.Draft7Validator({**SCHEMA, "oneOf": [{"$ref": "#/$defs/ClientMessage"}]})
    checked = 0
    for vector in vectors("refused"):
        if "json" in vector and vector["name"] not in ("broken JSON", "a frame as text"):
            assert not validator.is_valid(json.loads(vector["json"])), vector["name"]
            checked += 1
    assert checked > 15


def test_every_field_and_every_choice_of_words_says_what_it_means():
    meanings = importlib.import_module("meanings")
    fields = {kind: text for kind, text in meanings.of_fields().items() if kind in SCHEMA["$defs"]}
    for kind, said in fields.items():
        assert said.keys() == SCHEMA["$defs"][kind]["properties"].keys() - {"type"}, kind
    assert meanings.of_choices().keys() == meanings.choices().keys()


def test_a_stale_file_is_noticed(tmp_path, monkeypatch):
    generate = importlib.import_module("generate")
    monkeypatch.setattr(generate, "generated", lambda: iter([(tmp_path / "a.json", "{}")]))
    assert [generate.main(words) for words in (["--check"], [], ["--check"])] == [1, 0, 0]


def test_the_asyncapi_document_names_every_message_and_resolves_every_reference():
    document = importlib.import_module("generate").asyncapi()
    text = json.dumps(document)
    references = {part.split('"')[0] for part in text.split('"$ref": "#/')[1:]}
    for reference in references:
        target = document
        for step in reference.split("/"):
            target = target[step]
        assert target
    assert len(document["channels"]["socket"]["messages"]) == 16
    assert document["asyncapi"].startswith("3.")


@pytest.mark.parametrize(
    "data",
    [
        b"\x81\xa4type" * 200_000,
        b"\x91" * 600_000,
        b"\xdd\xff\xff\xff\xff" + b"\x80" * 100_000,
        "[" * 600_000,
        '{"type":' * 200_000,
    ],
    ids=["maps in maps", "lists in lists", "a million empty maps", "JSON lists", "JSON maps"],
)
def test_bombs_are_refused(data):
    with pytest.raises(MessageError):
        decode(data)
