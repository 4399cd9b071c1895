"""A person at the dashboard says what an object is, and the owner's scene takes it."""

import base64
import json
import urllib.error
import urllib.request

import pytest
from conftest import peer
from pace import PACE

from hapticvlm.client.local_service import running
from hapticvlm.commands.main import main

OBJECTS = [{"object_id": "thing", "name": "Object_07", "temperature_c": 12.0}]


def says(material, **more):
    objects = [{"object_id": "thing", "material": material, **more}]
    return {"type": "scene", "objects": objects, "replace": False}


async def test_what_an_observer_states_is_what_the_owner_feels(service):
    async with peer(service) as owner, peer(service) as observer:
        await owner.hello()
        await observer.hello(role="observer")
        await owner.ask(type="scene", objects=OBJECTS, replace=True)
        await owner.touch("contact", "thing")
        assert (await observer.ask(**says("metal")))["type"] == "ok"
        decision = await owner.event("decision", material="metal")
        assert (decision["object_id"], decision["source"]) == ("thing", "scene")
        assert decision["surface_c"] == 12.0  # as the scene gave it
        shown = await observer.event("decision", material="metal")
        assert shown["name"] == "Object_07"
        await owner.touch("release", "thing")


async def test_without_an_owner_there_is_nothing_to_state(service):
    async with peer(service) as observer:
        await observer.hello(role="observer")
        answer = await observer.ask(**says("metal"))
        assert (answer["type"], answer["code"]) == ("error", "not_owner")


TOKEN = "a token of a dozen"


def saved(service, headers=()):
    request = urllib.request.Request(service.page + "stated.json", headers=dict(headers))
    with urllib.request.urlopen(request, timeout=10 * PACE) as answer:
        return answer.read()


async def material_felt(service, object_id, objects):
    async with peer(service) as owner:
        await owner.hello(**({} if objects is None else {"token": TOKEN}))
        await owner.ask(type="scene", objects=objects or [], replace=True)
        await owner.touch("contact", object_id)
        decision = await owner.event("decision", object_id=object_id)
        await owner.touch("release", object_id)
    return decision["material"], decision["source"]


async def test_what_was_stated_is_saved_for_the_next_run_and_ends_with_its_scene(tmp_path):
    file, record = tmp_path / "stated.json", tmp_path / "sessions"
    with running() as service:
        async with peer(service) as owner, peer(service) as observer:
            await owner.hello()
            await observer.hello(role="observer")
            await owner.ask(type="scene", objects=OBJECTS, replace=True)
            assert json.loads(saved(service)) == {"objects": []}
            assert (await observer.ask(**says("metal")))["type"] == "ok"
            file.write_bytes(saved(service))
            await owner.ask(type="scene", objects=OBJECTS, replace=True)
            assert json.loads(saved(service)) == {"objects": []}
    assert json.loads(file.read_text()) == {
        "objects": [{"object_id": "thing", "material": "metal"}]
    }
    with running(["--stated", str(file), "--token", TOKEN, "--record", str(record)]) as service:
        assert await material_felt(service, "thing", OBJECTS) == ("metal", "scene")
        assert await material_felt(service, "thing", []) == ("metal", "scene")  # never declared
        own = [{**OBJECTS[0], "material": "glass"}]
        assert await material_felt(service, "thing", own) == (
            "glass",
            "scene",
        )  # a scene knows best
        with pytest.raises(urllib.error.HTTPError, match="401"):
            saved(service)
        password = base64.b64encode(f":{TOKEN}".encode()).decode()
        kept = saved(service, {"Authorization": f"Basic {password}"})
        assert json.loads(kept) == json.loads(file.read_text())
    for session in record.iterdir():
        assert main(["replay", str(session)]) == 0
