"""The service reports its state to systemd, and the example of a unit is one that systemd takes."""

import os
import shutil
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from pace import PACE

from hapticvlm.server import systemd

UNIT = Path(__file__).parents[2] / "examples" / "hapticvlm.service"
PROGRAM = "/opt/hapticvlm/bin/hapticvlm"

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such sockets")


@pytest.fixture
def manager(tmp_path):
    """The socket on which a service manager listens."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "notify"))
        listener.settimeout(60 * PACE)
        yield listener


def test_a_state_reaches_the_service_manager(manager, monkeypatch):
    monkeypatch.setenv("NOTIFY_SOCKET", manager.getsockname())
    systemd.notify(systemd.READY)
    assert manager.recv(100) == b"READY=1"


@pytest.mark.skipif(sys.platform != "linux", reason="abstract addresses are of Linux")
def test_an_abstract_address_is_understood(monkeypatch, tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(f"\0{tmp_path}")
        monkeypatch.setenv("NOTIFY_SOCKET", f"@{tmp_path}")
        systemd.notify(systemd.STOPPING)
        assert manager.recv(100) == b"STOPPING=1"


@pytest.mark.parametrize("address", [None, "", "/no/such/socket", "no address"])
def test_without_a_service_manager_nothing_happens(address, monkeypatch):
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    if address is not None:
        monkeypatch.setenv("NOTIFY_SOCKET", address)
    systemd.notify(systemd.READY)


def test_the_service_is_ready_when_it_says_so_and_says_that_it_stops(manager):
    command = [sys.executable, "-m", "hapticvlm", "serve", "--port", "0"]
    environment = os.environ | {"NOTIFY_SOCKET": manager.getsockname()}
    service = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    try:
        assert manager.recv(100) == b"READY=1"
        assert service.stdout is not None
        assert "ready on" in service.stdout.readline()
        service.send_signal(signal.SIGTERM)
        assert manager.recv(100) == b"STOPPING=1"
        assert service.wait(60 * PACE) == 0
    finally:
        service.kill()
        service.communicate()


def test_the_unit_starts_the_service_when_it_is_ready_and_says_so():
    rows = [row.partition("=") for row in UNIT.read_text().splitlines()]
    settings = {name: value for name, _, value in rows}
    assert settings["Type"] == "notify"
    assert settings["ExecStart"].startswith(f"{PROGRAM} serve ")


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd is not installed")
def test_systemd_takes_the_unit(tmp_path):
    unit = tmp_path / UNIT.name
    unit.write_text(UNIT.read_text().replace(PROGRAM, sys.executable))
    command = ["systemd-analyze", "verify", str(unit)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
