"""Devices of Intiface Central, as its engine sees this client: nobody here has held one."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest
from conftest import peer, status
from intiface_engine import IntifaceEngine
from pace import until
from scene_client import owner_of
from worn_outputs import shown

from hapticvlm.client.local_service import Service, running
from hapticvlm.devices.worn.intiface import Engine, value_of, warmth_of


@pytest.fixture(scope="module")
def engine() -> Iterator[IntifaceEngine]:
    engine = IntifaceEngine()
    yield engine
    engine.close()
    assert engine.wrong == []


@pytest.fixture(scope="module")
def service(engine: IntifaceEngine) -> Iterator[Service]:
    with running(["--hand", f"intiface=127.0.0.1:{engine.port}"]) as service:
        until(engine.has_started)
        yield service


async def test_a_slide_shakes_what_vibrates_and_nothing_else_until_the_hand_lets_go(
    engine, service
):
    async with peer(service) as client:
        await owner_of(client)
        await client.touch("contact", "table")

        async def slide() -> None:
            await client.touch("slide", "table", speed_mps=0.2, force_n=2.5)

        levels = {(3, 0, "Vibrate"), (3, 1, "Vibrate")}
        await shown(lambda: levels <= {key for key, value in engine.now.items() if value}, slide)
        assert not [key for key in engine.now if "Rotate" in key]
        await client.touch("release")
        await shown(lambda: not any(engine.value(*key) for key in levels))


async def test_cold_metal_cools_a_device_that_has_a_temperature(engine, service):
    async with peer(service) as client:
        await owner_of(client)

        async def hold() -> None:
            await client.touch("contact", "kettle")

        await shown(lambda: engine.value(5, 0, "Temperature") < -3, hold)
        await client.ask(type="stop", scope="peltier")
        await shown(lambda: engine.value(5, 0, "Temperature") == 0, hold)


async def test_a_device_that_leaves_is_told_and_searched_for_and_works_when_it_comes(
    engine, service
):
    async with peer(service) as client:
        await owner_of(client)
        for phase in ("release", "contact"):  # what the tests above stopped
            await client.touch(phase, "table")
        away, engine.devices = engine.devices, {}
        engine.now.clear()
        searches = engine.asked.count("StartScanning")
        engine.list_devices()
        await shown(lambda: worn(service)["state"] == "connected: no device")
        assert "no device" in worn(service)["faults"][0]
        until(lambda: engine.asked.count("StartScanning") > searches)
        engine.devices = away
        engine.list_devices()
        await shown(lambda: worn(service)["state"] == "connected: Pad, Warmer")

        async def slide() -> None:
            await client.touch("slide", "table", speed_mps=0.2)

        await shown(lambda: engine.value(3, 0, "Vibrate"), slide)


def test_an_engine_that_does_not_answer_or_speaks_another_version_is_left() -> None:
    silent = Engine()
    silent.greeting(now=1.0)
    assert silent.drive(0.0, 0.0, now=2.9) is None
    with pytest.raises(ConnectionError):
        silent.drive(0.0, 0.0, now=3.0)
    answers = {
        '[{"ServerInfo": {"Id": 1, "ProtocolVersionMajor": 3, "MaxPingTime": 0}}]': "version 3",
        '[{"Error": {"Id": 1, "ErrorMessage": "no", "ErrorCode": 1}}]': "update",
        '[{"DeviceList": {"Id": 0, "Devices": 3}}]': "not a message",
        '{"Ok": 3}': "not a message",
        "[" * 5000: "not a message",
    }
    for answer, words in answers.items():
        with pytest.raises(ValueError, match=words):
            Engine().receive(answer, 0.0)


def test_pings_come_three_times_in_the_time_that_the_engine_allows() -> None:
    engine = Engine()
    engine.greeting(0.0)
    version = {"ProtocolVersionMajor": 4, "ProtocolVersionMinor": 0}
    told = {"Id": 1, "ServerName": "E", "MaxPingTime": 900, **version}
    engine.receive(json.dumps([{"ServerInfo": told}]), 0.0)
    pings = [at / 10 for at in range(10) if "Ping" in (engine.drive(0.0, 0.0, at / 10) or "")]
    assert pings == [0.0, 0.3, 0.6, 0.9]


def test_values_are_whole_numbers_of_the_range_and_anything_felt_is_at_least_one() -> None:
    assert [value_of("Vibrate", (0, 20), level, 0.0) for level in (0.0, 0.001, 0.5, 1.0)] == [
        0,
        1,
        10,
        20,
    ]
    both = [value_of("Temperature", (-10, 10), 1.0, warmth_of(c)) for c in (18.0, 32.0, 40.0)]
    heater = [value_of("Temperature", (0, 1), 1.0, warmth_of(c)) for c in (18.0, 32.0, 40.0)]
    assert (both, heater) == ([-10, 0, 10], [0, 0, 1])


def worn(service):
    (output,) = status(service)["worn"].values()
    return output
