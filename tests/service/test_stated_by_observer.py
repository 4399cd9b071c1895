"""A person at the dashboard says what an object is, and the owner's scene takes it."""

from conftest import peer

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


async def test_what_an_observer_may_not_say_changes_nothing(service):
    async with peer(service) as owner, peer(service) as observer:
        await owner.hello()
        await observer.hello(role="observer")
        await owner.ask(type="scene", objects=OBJECTS, replace=True)
        refused = await observer.ask(**says("metal", temperature_c=200.0))
        assert (refused["type"], refused["path"]) == ("error", "$.objects[0]")
        unknown = await observer.ask(**says("mettal"))
        assert unknown["path"] == "$.objects[0].material"
        answer = await owner.touch("contact", "thing")
        assert answer["type"] == "ok"
        decision = await owner.event("decision", object_id="thing")
        assert decision["source"] != "scene"
        await owner.touch("release", "thing")


async def test_without_an_owner_there_is_nothing_to_state(service):
    async with peer(service) as observer:
        await observer.hello(role="observer")
        answer = await observer.ask(**says("metal"))
        assert (answer["type"], answer["code"]) == ("error", "not_owner")
