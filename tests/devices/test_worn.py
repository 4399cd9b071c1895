"""Outputs that people own, all at once: leases, stops, and programs that are lost or deaf."""

from __future__ import annotations

import pytest
from conftest import peer, status
from glove_program import GloveProgram
from intiface_engine import IntifaceEngine
from pace import until
from scene_client import owner_of
from worn_outputs import shown

from hapticvlm.client.local_service import running
from hapticvlm.devices.worn import table
from hapticvlm.devices.worn.output import Touch, Wanted, alive
from hapticvlm.rendering.vibration.vibration import Motion
from hapticvlm.rendering.vibration.voices import Command

Programs = tuple[GloveProgram, IntifaceEngine]
GONE = {"glove_gone", "intiface_gone"}


def hand(programs: Programs) -> list[str]:
    glove, engine = programs
    return ["--hand", f"weart=127.0.0.1:{glove.port},intiface=127.0.0.1:{engine.port}"]


def close(programs: Programs) -> None:
    for each in programs:
        each.close()


async def test_a_lease_that_ends_and_a_stop_rest_every_output():
    programs = GloveProgram(), IntifaceEngine()
    with running(hand(programs)) as service:
        async with peer(service) as client:
            await owner_of(client)

            async def slide() -> None:
                await client.touch("slide", "table", speed_mps=0.2)

            await shown(lambda: all(each.vibrates() for each in programs), slide)
            await shown(lambda: not any(each.vibrates() for each in programs))  # no more touches
            await client.touch("release")
            await shown(lambda: all(each.vibrates() for each in programs), slide)
            await client.ask(type="stop", scope="all")
            await shown(lambda: all(each.rests() for each in programs))
            assert (await client.touch("slide", "table"))["type"] == "error"  # a stop holds all
    until(lambda: all(each.ended for each in programs))
    assert programs[0].stops == 1
    assert programs[1].asked[-1] == "StopCmd"
    close(programs)


async def test_lost_programs_are_told_and_found_again_and_a_kill_ends_the_connections():
    programs = GloveProgram(), IntifaceEngine()
    with running(hand(programs)) as service:
        until(lambda: all(each.has_started() for each in programs))
        async with peer(service) as client:
            await client.hello("observer")
            close(programs)
            while not set((await client.telemetry())["faults"]) >= GONE:
                pass  # `telemetry` has a bound of its own
            assert all("not connected" in each["state"] for each in worn(service))
        back = GloveProgram(programs[0].port), IntifaceEngine(programs[1].port)
        until(lambda: all(each["state"].startswith("connected") for each in worn(service)))
        until(lambda: all(each.has_started() for each in back))
        service.process.kill()
    until(lambda: all(each.ended for each in back))
    assert back[0].stops == 0
    close(back)


@pytest.mark.nightly
async def test_no_touch_waits_for_programs_that_never_answer():
    deaf = GloveProgram(answers=False), IntifaceEngine(answers=False)
    with running(hand(deaf)) as service:
        async with peer(service) as client:
            await owner_of(client)
            for _ in range(20):
                assert (await client.touch("slide", "table"))["type"] == "ok"
            until(lambda: deaf[1].ended)  # it is left, and tried again
    close(deaf)


def test_each_value_ends_with_its_lease_though_nobody_releases() -> None:
    slide = Command(1, "wood", "slide", False, Motion(0.2, 2.5), 1, expires_at=10.0)
    wanted = Wanted({1: Touch(slide, None, 9.0)}, setpoint_c=24.0)
    assert alive(wanted, 10.0, now=9.99) == wanted
    assert alive(wanted, 10.0, now=10.0) == Wanted()


@pytest.mark.parametrize("place", ["weart=somewhere", "intiface=:1", "weart=a:70000", "glove"])
def test_a_place_that_is_none_is_refused(place: str) -> None:
    with pytest.raises(ValueError, match="hand: "):
        table.place(place)


def worn(service):
    return status(service)["worn"].values()
