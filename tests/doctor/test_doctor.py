"""`hapticvlm doctor` on this machine, with real ports, services and certificates, good and bad."""

import asyncio
import json
import os
import re
import socket
import sys
import threading
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from certificates import Authority
from in_process import hapticvlm
from intiface_engine import IntifaceEngine
from pace import PACE, until
from plate_ports import Cable
from ports import free_port
from websockets.asyncio.server import serve
from websockets.exceptions import ConnectionClosed

from hapticvlm.client.local_service import running
from hapticvlm.commands.doctor import sentence
from hapticvlm.devices.plate import protocol as line
from hapticvlm.devices.plate.peltier import Peltier
from hapticvlm.doctor import devices, machine, network
from hapticvlm.doctor.findings import BackgroundCheck, Finding
from hapticvlm.server.settings import ServeOptions

ROOT = Path(__file__).parents[2]
PATIENCE_S = 120.0 * PACE
TOKEN = "a token of a dozen"


def doctor(*arguments: str) -> tuple[int, dict[str, Any]]:
    done = hapticvlm("doctor", "--json", *arguments)
    return done.code, json.loads(done.out)


def config(folder: Path, **stated: object) -> str:
    lines = [f"{name.replace('_', '-')} = {json.dumps(value)}" for name, value in stated.items()]
    path = folder / "hapticvlm.toml"
    path.write_text("\n".join(lines))
    path.chmod(0o600)
    return str(path)


def test_a_machine_without_problems_gets_ok(tmp_path):
    code, told = doctor("--config", config(tmp_path, port=free_port()))
    assert (code, told["doctor"]) == (0, "ok")
    about = {one["about"]: one["verdict"] for one in told["findings"]}
    for name in ("python", "packages", "extras", "clock", "priority", "encoder", "port"):
        assert about[name] in ("ok", "note")
    assert {"audio", "plate"} <= set(about)


def test_what_will_not_work_is_exit_code_1_and_has_a_cure_in_its_line(tmp_path):
    path = config(tmp_path, peltier="/dev/nowhere", gallery="none", host="0.0.0.0")
    done = hapticvlm("doctor", "--config", path)
    assert done.code == 1
    wrong = [line for line in done.out.splitlines() if line.startswith("WRONG")]
    assert len(wrong) == 3
    for about, cause in (("encoder", "none"), ("address", "--token"), ("plate", "/dev/nowhere")):
        assert any(about in line and cause in line and "->" in line for line in wrong)


def test_a_wrong_config_is_a_finding_and_the_rest_is_still_examined(tmp_path):
    code, told = doctor("--config", config(tmp_path, prot=1))
    assert code == 1
    found = {one["about"]: one for one in told["findings"]}
    assert {"prot", "port"} <= set(re.findall(r"\w+", found["config"]["message"]))
    assert found["encoder"]["verdict"] != "wrong"


def test_a_service_at_the_port_is_known_with_its_version():
    from hapticvlm import __version__

    with running() as service:
        port = int(service.url.rstrip("/").rpartition(":")[2])
        finding = network.port(ServeOptions(port=port))
    assert finding.verdict == "note"
    assert __version__ in finding.message


async def test_no_program_at_the_port_is_sent_the_token():
    received = []

    async def read(socket):
        received.append(socket.request.headers)
        with suppress(ConnectionClosed):  # after a while without an answer
            received.append(await socket.recv())
            await socket.wait_closed()

    async with serve(read, "127.0.0.1", 0) as server:
        port = server.sockets[0].getsockname()[1]
        options = ServeOptions(port=port, token=TOKEN)
        await asyncio.to_thread(network.port, options)
        server.close()
        await server.wait_closed()
    assert len(received) == 2
    assert "doctor" in str(received[1])
    assert TOKEN not in str(received)


def test_a_service_that_wants_a_token_is_known_without_it():
    with running(["--token", TOKEN]) as service:
        port = int(service.url.rstrip("/").rpartition(":")[2])
        finding = network.port(ServeOptions(port=port, token=TOKEN))
    assert finding.verdict == "note"
    assert "token" in finding.message


@contextmanager
def stranger(greeting: bytes) -> Iterator[int]:
    """Another program at a port, which says something and nothing more."""

    def run(listener: socket.socket) -> None:
        with suppress(OSError):
            client, _ = listener.accept()
            client.sendall(greeting)
            time.sleep(0.2)
            client.close()

    with socket.create_server(("127.0.0.1", 0)) as listener:
        threading.Thread(target=run, args=(listener,), daemon=True).start()
        yield listener.getsockname()[1]


@pytest.mark.parametrize("greeting", [b"", b"220 mail\r\n", b"HTTP/1.1 200 OK\r\n\r\n", b"\x00"])
def test_another_program_at_the_port_is_wrong(greeting):
    with stranger(greeting) as port:
        found = network.port(ServeOptions(port=port))
    assert found.verdict == "wrong"
    assert "--port" in str(found.cure)


def test_an_address_that_is_not_of_this_machine_is_wrong():
    assert network.port(ServeOptions(host="203.0.113.7", port=free_port())).verdict == "wrong"


def test_a_certificate_is_reported_with_names_and_days(tmp_path):
    pair = Authority(tmp_path).sign()
    (found,) = network.address(ServeOptions(tls_cert=pair.cert, tls_key=pair.key))
    assert found.verdict == "ok"
    assert "127.0.0.1, localhost" in found.message
    (wrong,) = network.address(ServeOptions(tls_cert=pair.cert))
    assert wrong.verdict == "wrong"


def test_a_plate_that_answers_is_named_and_gets_no_setpoint():
    cable = Cable()
    plate = Peltier("cable", open_port=cable.open, clock=cable.clock)
    found = devices.check_plate("cable", plate, is_required=True)
    assert found.verdict == "ok"
    kinds = {type(message) for message in cable.sent}
    assert kinds
    assert line.Setpoint not in kinds


def test_a_plate_that_is_silent_is_wrong_only_if_it_was_asked_for():
    for is_required, verdict in ((True, "wrong"), (False, "note")):
        cable = Cable()
        cable.is_mute = True
        plate = Peltier("cable", open_port=cable.open, clock=cable.clock)
        found = devices.check_plate("cable", plate, is_required)
        assert found.verdict == verdict


@pytest.mark.skipif(os.name != "posix" or not hasattr(os, "geteuid"), reason="POSIX permissions")
def test_a_port_that_may_not_be_opened_names_its_group(tmp_path):
    if os.geteuid() == 0:
        assert "usermod -aG" in devices._join_group(Path("/dev/null"))
        return
    port = tmp_path / "port"
    port.touch(0o000)
    (found,) = devices.plates(ServeOptions(peltier=str(port)))
    assert found.verdict == "wrong"
    assert "usermod -aG" in str(found.cure)


def test_a_program_of_a_worn_output_is_named_only_if_it_answers_as_one():
    status = b'{"type": "MW_STATUS", "ts": 1, "data": {"status": "IDLE"}}~'
    for greeting, names in ((status, ["weart"]), (b"220 mail~", [])):
        with stranger(greeting) as port:
            assert hand_findings(f"weart=127.0.0.1:{port}") == names
    engine = IntifaceEngine()
    assert hand_findings(f"intiface=127.0.0.1:{engine.port}") == ["intiface"]
    until(lambda: engine.ended)
    assert engine.asked == ["RequestServerInfo"]
    engine.close()


def hand_findings(hand: str) -> list[str]:
    """Return what is found of this hand, whatever else runs on this machine."""
    name = hand.partition("=")[0]
    found = [one.about for one in devices.worn(ServeOptions(hand=hand)) if one.about == name]
    assert len(found) <= 1
    return found


def test_an_output_that_is_not_there_is_wrong_and_a_simulated_one_never():
    names = [{"name": "Built-in Audio"}, {"name": "USB DAC"}]
    assert devices.found_audio(ServeOptions(speaker="dac"), names).verdict == "ok"
    assert devices.found_audio(ServeOptions(speaker="default"), names).verdict == "ok"
    assert devices.found_audio(ServeOptions(speaker="default"), []).verdict == "wrong"
    absent = devices.found_audio(ServeOptions(speaker="HDMI"), names)
    assert absent.verdict == "wrong"
    assert "USB DAC" in absent.message
    assert devices.found_audio(ServeOptions(), []).verdict == "ok"


def test_packages_that_are_missing_or_old_are_named_and_those_of_extras_do_no_harm():
    core, extras = machine.judged(
        ["nosuchpackage>=1", "numpy>=999", "msgspec>=0.1", "nosuchextra>=2; extra == 'video'"]
    )
    assert core.verdict == "wrong"
    assert {"nosuchpackage", "numpy", "999"} <= set(re.findall(r"\w+", core.message))
    assert "msgspec" not in core.message
    assert extras.verdict == "ok"
    assert "install opencv-python-headless" in str(extras.cure)


def test_every_extra_it_looks_for_is_one_that_the_package_has():
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    for name, packages in machine.EXTRAS.items():
        bare = [re.split("[>=]", text)[0] for text in stated["optional-dependencies"][name]]
        assert " ".join(bare) == packages, name


def test_what_this_package_states_is_understood_whole():
    core, extras = machine.packages()
    assert core.verdict == "ok"
    assert extras.verdict == "ok"


def test_the_findings_are_summed_up_and_a_slow_encoder_is_not_loaded():
    slow = machine.encoder(ServeOptions(encoder="facebook/convnextv2-tiny-22k-224"))
    assert (slow.verdict, "not loaded, because it is slow" in slow.message) == ("ok", True)
    note, wrong = Finding("clock", "note", ""), Finding("plate", "wrong", "")
    for findings, begins in (
        ([slow], "Nothing is wrong: "),
        ([slow, note], "Nothing is wrong; 1 note on"),
        ([note, note], "Nothing is wrong; 2 notes on"),
        ([slow, wrong, note], "1 wrong (plate): "),
    ):
        assert sentence(findings).startswith(begins)


def test_a_check_that_hangs_delays_nothing():
    ending = threading.Event()

    def hang() -> list[Finding]:
        ending.wait(PATIENCE_S)
        return []

    (found,) = BackgroundCheck("audio", hang).by(time.monotonic() + 0.05)
    ending.set()
    assert (found.about, found.verdict) == ("audio", "note")


@pytest.mark.skipif(sys.platform != "linux", reason="scheduling classes of Linux")
def test_asking_for_priority_leaves_none_behind():
    machine.priority(ServeOptions())
    assert os.sched_getscheduler(0) == os.SCHED_OTHER
