"""Touches that renew themselves, with and without await, and a service inside a program."""

import asyncio
import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from pace import PACE

import hapticvlm
from hapticvlm import HapticVLMError, Refused, TouchEnded

pytestmark = pytest.mark.process
CUP = [{"object_id": "cup", "material": "ceramic", "temperature_c": 50.0}]
PATIENCE_S = 20.0 * PACE


def leases(client, wanted):
    """Wait until telemetry counts this many leases."""
    until = time.monotonic() + PATIENCE_S
    while (count := client.next_event("telemetry", seconds=PATIENCE_S)["leases"]) != wanted:
        assert time.monotonic() < until, f"{count} leases, not {wanted}"


def counted(client, times):
    """Return the leases that telemetry counts, this many times, a tenth of a second apart."""
    client.events()
    return [client.next_event("telemetry", seconds=PATIENCE_S)["leases"] for _ in range(times)]


def test_a_touch_lasts_as_long_as_its_block(service):
    with hapticvlm.connect_blocking(service.url) as client:
        client.scene(CUP)
        with client.touching("cup", speed_mps=0.0) as hand:
            assert client.next_event("decision", seconds=PATIENCE_S)["material"] == "ceramic"
            leases(client, 1)
            hand.speed_mps = 0.3
            counted(client, 10)  # a second: four leases
            leases(client, 1)
        leases(client, 0)


def test_an_error_in_the_block_ends_the_touch_and_leaves_the_connection(service):
    with hapticvlm.connect_blocking(service.url) as client:
        client.scene(CUP)
        with pytest.raises(KeyboardInterrupt), client.touching("cup", hand="left"):  # noqa: PT012
            leases(client, 1)
            raise KeyboardInterrupt
        leases(client, 0)
        with client.touching("cup", interaction="tap"):
            leases(client, 1)


def test_a_block_that_hangs_does_not_touch_for_ever(service):
    with hapticvlm.connect_blocking(service.url) as client:
        client.scene(CUP)
        with pytest.raises(TouchEnded, match="longest_s"), client.touching("cup", longest_s=0.2):  # noqa: PT012
            counted(client, 10)
            leases(client, 0)
        for wrong in (0.0, 901.0, float("nan")):
            touch = client.touching("cup", longest_s=wrong)
            with pytest.raises(HapticVLMError, match="longest_s"), touch:
                pass


def test_a_stop_ends_a_touch_for_good_and_the_block_hears_of_it(service):
    with hapticvlm.connect_blocking(service.url) as client:
        client.scene(CUP)
        with pytest.raises(Refused, match="unsafe"), client.touching("cup"):  # noqa: PT012
            leases(client, 1)
            client.stop()
            leases(client, 0)
            assert counted(client, 5) == [0] * 5
        with client.touching("cup"):
            leases(client, 1)


def test_an_object_that_does_not_exist_is_refused_at_the_contact(service):
    with hapticvlm.connect_blocking(service.url) as client:
        client.scene(CUP)
        with pytest.raises(Refused), client.touching(""):
            pytest.fail("the block began")


@pytest.mark.skipif(os.name == "nt", reason="Windows cannot pause a process")
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP], ids=lambda end: end.name)
def test_a_touch_ends_with_the_process_or_its_pause(service, end):
    code = "import sys, time, hapticvlm\nwith hapticvlm.connect_blocking(sys.argv[1]) as client:\n"
    code += "    client.scene([{'object_id': 'cup', 'material': 'wood'}])\n"
    code += "    with client.touching('cup'): print('touching', flush=True); time.sleep(600)\n"
    with hapticvlm.connect_blocking(service.url, role="observer") as client:
        command = [sys.executable, "-c", code, service.url]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "touching\n"
            leases(client, 1)
            process.send_signal(end)
            leases(client, 0)
        finally:
            process.kill()
            process.communicate()


def test_a_closed_connection_says_so_and_leaves_no_thread(service):
    before = threading.active_count()
    client = hapticvlm.connect_blocking(service.url)
    assert client.welcome["owner"]
    client.close()
    client.close()
    assert threading.active_count() == before
    with pytest.raises(ConnectionError, match="open another"):
        client.stop()


def test_an_address_without_a_service_raises_at_once_and_leaves_no_thread():
    before = threading.active_count()
    with pytest.raises(OSError):  # noqa: PT011
        hapticvlm.connect_blocking("ws://127.0.0.1:1/")
    assert threading.active_count() == before


def test_a_program_serves_itself_and_an_option_that_does_not_exist_is_named():
    served = hapticvlm.serve(peltier="simulated", record=None)
    with served as service, hapticvlm.connect_blocking(service.url) as client:
        assert client.welcome["owner"]
    assert service.process.poll() is not None
    with pytest.raises(HapticVLMError, match="--no-such-option"), hapticvlm.serve(no_such_option=1):
        pass


async def test_with_await_a_touch_renews_itself_too(service):
    async with hapticvlm.connect(service.url) as client:
        await client.scene(CUP)
        async with client.touching("cup"), asyncio.timeout(PATIENCE_S):
            seen: list[int] = []
            while len(seen) < 10 or seen[-1] != 1:
                event = await client.events.get()
                seen += [event["leases"]] if event["type"] == "telemetry" else []
