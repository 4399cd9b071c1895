"""The `vibration` event over a real WebSocket: what a controller plays of what the hands feel."""

import asyncio
import time
from contextlib import suppress

import pytest
from conftest import ANSWER_S, EVENT_S, peer
from gateways import new_gateway

from hapticvlm.client.local_service import running
from hapticvlm.messages import Vibration
from hapticvlm.rendering.vibration.vibration import Motion
from hapticvlm.rendering.vibration.voices import Command
from hapticvlm.session.actions import PlayVibration, ReleaseHand

PANE = {"object_id": "pane", "material": "glass"}
PERIODS_MS = {"amplitude": 12.5, "parametric": 5.0}
HORIZON_MS = 100.0
SILENCE_S = 0.1


async def feeling(client, **forms):
    """An owner that gets vibration events: the first ones tell that the planners are ready."""
    await client.hello()
    await client.ask(type="scene", objects=[PANE], replace=True)
    assert (await client.ask(type="set", feel=forms or {"right": "amplitude"}))["type"] == "ok"
    hand = next(iter(forms), "right")
    for held in ("left", "right"):  # by a stop of the test before
        await client.touch("release", hand=held)
        await client.touch("approach", "pane", hand=held)
        await client.touch("release", hand=held)
    async with asyncio.timeout(ANSWER_S):
        while not [event for event in client.events if event["type"] == "vibration"]:
            await client.touch("slide", "pane", hand=hand)
            await asyncio.sleep(0.02)
    await silenced(client, await client.touch("release", hand=hand))


async def silenced(client, _):
    """Read until an empty plan has come; then nothing is felt."""
    while (await client.event("vibration")).get("amplitude"):
        pass
    client.events.clear()


async def rub(client, seconds, hand="right"):
    """Slide as a client does, 50 times a second; return the plans that came meanwhile."""
    ends = time.monotonic() + seconds
    while time.monotonic() < ends:
        await client.touch("slide", "pane", hand=hand)
        await asyncio.sleep(0.02)
    plans = [event for event in client.events if event["type"] == "vibration"]
    client.events = [event for event in client.events if event["type"] != "vibration"]
    return plans


@pytest.mark.parametrize("form", ["amplitude", "parametric"])
@pytest.mark.realtime
async def test_a_rubbing_hand_gets_plans_20_to_30_times_a_second(service, form):
    async with peer(service) as client:
        await feeling(client, right=form)
        plans = [plan for plan in await rub(client, 2.0) if plan.get("amplitude")]
        # A busy machine wakes late, and may let a lease lapse, which is planned as empty.
        assert 15 <= len(plans) / 2.0 <= 31
        for plan in plans:
            assert plan["hand"] == "right"
            assert plan["period_ms"] == PERIODS_MS[form]
            assert len(plan["amplitude"]) * plan["period_ms"] <= HORIZON_MS
            assert all(0.0 <= value <= 1.0 for value in plan["amplitude"])
            sized = len(plan["amplitude"]) if form == "parametric" else 0
            assert len(plan.get("frequency_hz", [])) == sized


@pytest.mark.realtime
async def test_a_contact_is_planned_at_once_with_its_transient(service):
    async with peer(service) as client:
        await feeling(client, left="parametric")
        async with asyncio.timeout(EVENT_S):
            while (plan := await tapped(client)) is None:
                await client.touch("release", hand="left")
        (pulse,) = plan["transients"]
        assert pulse["frequency_hz"] == 350.0
        assert max(plan["amplitude"]) > 0.1


async def tapped(client):
    """Tap; return the plan at once, or None, as a tap that comes late is felt late or not at all.

    A lease of the slides that lapsed on a busy machine leaves a plan of theirs to come before.
    """
    began = time.monotonic()
    await client.touch("contact", "pane", hand="left", interaction="tap")
    with suppress(TimeoutError):
        async with asyncio.timeout(began + SILENCE_S - time.monotonic()):
            while "transients" not in (plan := await client.event("vibration", hand="left")):
                pass
            return plan


@pytest.mark.realtime
@pytest.mark.parametrize("end", ["release", "lapse", "stop", "speaker"])
async def test_whatever_ends_a_touch_sends_an_empty_plan_at_once(service, end):
    async with peer(service) as client:
        await feeling(client)
        assert await rub(client, 0.3)
        began = time.monotonic()
        if end == "release":
            await client.touch("release")
        elif end != "lapse":
            await client.ask(type="stop", scope="all" if end == "stop" else end)
        while (plan := await client.event("vibration")).get("amplitude"):
            assert time.monotonic() - began < 0.25 + SILENCE_S
        assert time.monotonic() - began < (0.25 if end == "lapse" else 0.0) + SILENCE_S
        assert plan.get("stopped", False) == (end in ("stop", "speaker"))
        await client.touch("release")
        client.events.clear()
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.3):
                await client.event("vibration")


async def test_the_owner_learns_of_another_connections_stop(service):
    async with peer(service) as client, peer(service) as other:
        await feeling(client, left="amplitude", right="amplitude")
        await other.hello(role="observer")
        await other.ask(type="stop", scope="all")
        hands = {(await client.event("vibration", stopped=True))["hand"] for _ in range(2)}
        assert hands == {"left", "right"}
        assert (await client.touch("contact", "pane"))["code"] == "unsafe"
        for hand in ("left", "right"):
            await client.touch("release", hand=hand)
        await client.touch("contact", "pane")
        assert (await client.event("vibration", hand="right"))["amplitude"]


async def test_the_gain_scales_the_amplitude(service):
    async with peer(service) as client:
        await feeling(client)
        loud = max(value for plan in await rub(client, 0.5) for value in plan.get("amplitude", ()))
        await client.ask(type="set", vibration_gain=0.25)
        await rub(client, 0.1)
        quiet = max(value for plan in await rub(client, 0.5) for value in plan.get("amplitude", ()))
        assert 0.1 * loud < quiet < 0.5 * loud


async def test_only_the_owner_may_ask_and_nobody_gets_what_nobody_asked_for(service):
    async with peer(service) as client, peer(service) as other:
        await client.hello()
        await other.hello()
        refused = await other.ask(type="set", feel={"right": "amplitude"})
        assert (refused["code"], refused["path"]) == ("not_owner", "$.feel")
        await client.ask(type="scene", objects=[PANE], replace=True)
        assert not await rub(client, 0.3)
        await client.touch("release", hand="right")  # a hand that touches gets a plan at once
        await client.ask(type="set", feel={"right": "amplitude"})
        await client.ask(type="set", feel={})
        assert not await rub(client, 0.5)
        wrong = await client.ask(type="set", feel={"right": "pcm"})
        assert (wrong["code"], wrong["path"]) == ("message", "$.feel.right")


async def test_a_scene_that_asks_and_rubs_at_once_feels_it():
    with running() as fresh:
        async with peer(fresh) as client:
            await client.hello()
            await client.ask(type="scene", objects=[PANE], replace=True)
            await client.ask(type="set", feel={"right": "amplitude"})
            async with asyncio.timeout(ANSWER_S):
                while not await rub(client, 0.1):
                    pass


def a_minute_of_slides(hand=1):
    motion = Motion(0.3, 1.5)  # longer than a busy machine takes to make the planners
    return PlayVibration(Command(hand, "glass", "slide", False, motion, 1, time.monotonic() + 60.0))


@pytest.mark.parametrize("ends", [False, True])
async def test_what_a_hand_does_while_planners_are_made_is_felt_once_they_are(ends):
    posted: list[Vibration] = []
    events = new_gateway().vibration
    events.subscribe((None, "amplitude"), posted.append)
    events.drive(a_minute_of_slides())
    if ends:
        events.drive(ReleaseHand(1))
    assert events._making is not None
    await events._making
    await asyncio.sleep(0.0)
    events.tick(time.monotonic())
    assert bool([plan for plan in posted if plan.amplitude]) is not ends
