"""`hapticvlm plate simulate`: the other commands use its port as that of a real board."""

import socket
import subprocess
import sys
import threading
from contextlib import suppress

import pytest

from hapticvlm.commands.main import main
from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.simulated.practise_plate import PractisePlate, serve

pytestmark = [pytest.mark.process, pytest.mark.slow]


@pytest.fixture(scope="module")
def practise():
    """A simulated plate with a latched fault: its address, and the process that runs it."""
    command = ["plate", "simulate", "--port", "0"]
    with subprocess.Popen(
        [sys.executable, "-u", "-m", "hapticvlm", *command],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdin is not None
        assert process.stdout is not None
        words = process.stdout.readline().split()
        address = next(word for word in words if word.startswith("socket://")).rstrip(";")
        for _ in range(5):
            process.stdout.readline()
        process.stdin.write("runaway\n")
        process.stdin.flush()
        assert "runaway latched" in process.stdout.readline()
        yield address, process
        process.terminate()


def printed(capsys, *words):
    assert main(["plate", *words]) == 0
    return capsys.readouterr().out


def test_a_latched_fault_is_printed_with_its_cure_and_cleared_by_it(practise, capsys):
    address, _ = practise
    cure = f"hapticvlm plate clear runaway --port {address}"
    assert cure in printed(capsys, "status", "--port", address)
    assert cure in printed(capsys, "clear", "--port", address)
    assert "runaway cleared" in printed(capsys, *cure.split()[2:])
    assert "no faults" in printed(capsys, "status", "--peltier", address)


def test_a_fault_that_is_typed_is_latched_and_a_wrong_name_gets_the_right_ones(practise, capsys):
    address, process = practise
    process.stdin.write("plate_a_opne\nplate_a_open\n")
    process.stdin.flush()
    refusal, latched = process.stdout.readline(), process.stdout.readline()
    assert "plate_a_opne: no fault of the firmware" in refusal
    assert "sink_open" in refusal
    assert "plate_a_open latched" in latched
    assert "plate_a_open, number 1" in printed(capsys, "status", "--port", address)


def test_a_dry_run_of_flash_asks_the_board_and_writes_nothing(practise, capsys):
    address, _ = practise
    told = printed(capsys, "flash", "--dry-run", "--port", address)
    assert "firmware 0.0.0" in told
    assert "nothing was written" in told


def test_a_host_that_leaves_without_a_word_leaves_the_port_to_the_next():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        threading.Thread(target=_until_closed, args=(listener,), daemon=True).start()
        for _ in range(2):
            with socket.create_connection(listener.getsockname()) as host:
                assert host.recv(1)  # telemetry
        with suppress(OSError):  # only Linux lets a listener shut down
            listener.shutdown(socket.SHUT_RDWR)


def _until_closed(listener):
    try:
        serve(listener, PractisePlate())
    except OSError:
        return


def test_a_fault_that_the_firmware_does_not_have_is_refused():
    with pytest.raises(DeviceError, match="they are plate_a_open"):
        PractisePlate().latch("speaker_gone")
