"""A TouchDIVER, as the maker's program sees it: nobody here has worn one."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
import time
from collections.abc import Iterator

import pytest
from conftest import peer, status
from pace import PACE, until
from scene_client import owner_of

from hapticvlm.client.local_service import Service, running
from hapticvlm.devices.touchdiver import (
    POINTS,
    TEXTURES,
    TouchDiver,
    Wanted,
    changes,
    felt_of,
    messages,
    state_in,
)
from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.vibration import Motion
from hapticvlm.rendering.vibration.voices import Command

# As the maker's own library, weartsdk 2.0.3, writes them (run here on 2026-11-28). Its parser reads
# back only the stops: it cannot make the three others.
WRITTEN_BY_THE_MAKER = [
    "temperature:0.3:RIGHT:PALM",
    "stopTemperature:RIGHT:PALM",
    "force:0.25:0.0:0.0:RIGHT:PALM",
    "stopForce:RIGHT:PALM",
    "texture:12:0.5:0.0:0.2:80.0:RIGHT:PALM",
    "stopTexture:RIGHT:PALM",
]


class Program:
    """Stands in for the maker's program: what each point of each hand does now, by its texts."""

    def __init__(self, port: int = 0, *, reads: bool = True) -> None:
        self.listener = socket.create_server(("127.0.0.1", port))
        self.port = self.listener.getsockname()[1]
        self.starts = self.stops = self.ended = 0
        self.now: dict[tuple[str, str, str], list[str]] = {}
        self.connection: socket.socket | None = None
        self._reads = reads
        threading.Thread(target=self._run, daemon=True).start()

    def kinds(self) -> set[str]:
        return {kind for kind, _, _ in list(self.now)}

    def fields(self, kind: str, hand: str = "RIGHT") -> list[str]:
        return self.now.get((kind, hand, "PALM"), [])

    def close(self) -> None:
        for part in (self.listener, self.connection):
            if part is not None:
                with contextlib.suppress(OSError):
                    part.shutdown(socket.SHUT_RDWR)
                part.close()

    def _run(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                self.connection, _ = self.listener.accept()
                if self._reads:
                    self._read(self.connection)
                    self.ended += 1

    def _read(self, connection: socket.socket) -> None:
        rest = ""
        while more := connection.recv(4096):
            *texts, rest = (rest + more.decode()).split("~")
            for text in texts:
                self._take(text)

    def _take(self, text: str) -> None:
        kind, *fields = text.split(":")
        if kind == "StartFromClient":
            self.starts += 1
            self.now = {}
        elif kind == "StopFromClient":
            self.stops += 1
        elif kind.startswith("stop"):
            self.now.pop((kind[4:].lower(), fields[-2], fields[-1]), None)
        elif kind in ("force", "texture", "temperature"):
            self.now[kind, fields[-2], fields[-1]] = fields[:-2]


@pytest.fixture(scope="module")
def program() -> Iterator[Program]:
    program = Program()
    yield program
    program.close()


@pytest.fixture(scope="module")
def service(program: Program) -> Iterator[Service]:
    with running(["--hand", f"weart=127.0.0.1:{program.port}"]) as service:
        until(lambda: program.starts)
        yield service


def test_each_text_is_written_as_the_makers_library_writes_it() -> None:
    values = {"temperature": "0.3", "force": "0.25:0.0:0.0", "texture": "12:0.5:0.0:0.2:80.0"}
    now = {(kind, "RIGHT"): value for kind, value in values.items()}
    ours = [*changes({}, now), *changes(now, {})]
    assert sorted(text for text in ours if text.endswith("PALM")) == sorted(WRITTEN_BY_THE_MAKER)
    assert len(ours) == len(POINTS) * len(WRITTEN_BY_THE_MAKER)


def test_every_material_has_a_texture_that_the_glove_has() -> None:
    assert TEXTURES.keys() == MATERIALS.keys()
    assert all(3 <= index <= 21 for index in TEXTURES.values())


def test_each_value_ends_with_its_lease_though_nobody_releases() -> None:
    slide = Command(1, "wood", "slide", False, Motion(0.2, 2.5), 1, expires_at=10.0)
    felt = felt_of(slide, MATERIALS["wood"], None, now=9.9)
    wanted = Wanted({1: felt}, temperature=0.2, warm_until=10.0)
    assert len(messages(wanted, 9.99)) == 3
    assert messages(wanted, 10.0) == {}


async def test_a_slide_is_felt_as_its_material_and_a_release_rests_the_glove(program, service):
    async with peer(service) as client:
        await owner_of(client)
        await client.touch("contact", "table")

        async def slide() -> None:
            await client.touch("slide", "table", speed_mps=0.2, force_n=2.5)

        await until_program(lambda: program.fields("texture")[:1] == ["12"], slide)
        assert program.fields("texture")[3] == "0.20"
        assert program.fields("force") == ["0.50", "0.0", "0.0"]
        assert {hand for _, hand, _ in list(program.now)} == {"RIGHT"}
        await client.touch("release")
        await until_program(lambda: not program.kinds() & {"texture", "force"})


async def test_cold_metal_cools_the_hand_that_touches_it(program, service):
    async with peer(service) as client:
        await owner_of(client)

        async def hold() -> None:
            await client.touch("contact", "kettle")

        await until_program(lambda: float((program.fields("temperature") or ["1"])[0]) < 0.3, hold)
        await client.touch("release")
        await until_program(lambda: not program.kinds())


async def test_a_lease_that_ends_and_a_stop_rest_the_glove(program, service):
    async with peer(service) as client:
        await owner_of(client)

        async def slide() -> None:
            await client.touch("slide", "table")

        await until_program(lambda: "texture" in program.kinds(), slide)
        await until_program(lambda: not program.kinds() & {"texture", "force"})  # no more touches
        await client.touch("release")
        await until_program(lambda: "texture" in program.kinds(), slide)
        await client.ask(type="stop", scope="all")
        await until_program(lambda: not program.kinds())
        assert (await client.touch("slide", "table"))["type"] == "error"  # held, as all outputs are


async def test_a_lost_program_is_told_and_found_again_and_a_kill_ends_the_connection():
    program = Program()
    with running(["--hand", f"weart=127.0.0.1:{program.port}"]) as service:
        until(lambda: program.starts)
        async with peer(service) as client:
            await client.hello("observer")
            program.close()
            until(lambda: worn(service)["faults"])
            assert "WEART" in worn(service)["faults"][0]
            assert "glove_gone" in (await client.telemetry())["faults"]
        back = Program(program.port)
        until(lambda: worn(service)["state"] == "connected" and back.starts)
        service.process.kill()
    until(lambda: back.ended)
    assert back.stops == 0
    back.close()


def test_the_end_of_the_service_rests_the_glove_and_says_so():
    program = Program()
    with running(["--hand", f"weart=127.0.0.1:{program.port}"]):
        until(lambda: program.starts)
    until(lambda: program.ended)
    assert program.stops == 1
    assert not program.kinds()
    program.close()


@pytest.mark.nightly
async def test_no_touch_waits_for_a_program_that_never_reads():
    deaf = Program(reads=False)
    with running(["--hand", f"weart=127.0.0.1:{deaf.port}"]) as service:
        async with peer(service) as client:
            await owner_of(client)
            for _ in range(20):
                assert (await client.touch("slide", "table"))["type"] == "ok"
    deaf.close()


def test_answers_are_told_in_words() -> None:
    uploading = '{"type": "WA_STATUS", "ts": 1, "data": {"status": "UPLOADING_TEXTURES"}}'
    alone = '{"type": "MW_STATUS", "ts": 1, "data": {"status": "IDLE", "connectedDevices": []}}'
    told = {
        "CalibrationStatus:1:1": "calibrating: keep the hand still",
        "CalibrationStatus:0:2": "running",
        "CalibrationResult:1:1": "calibration failed: start it again",
        uploading: "uploading textures",
        alone: "no glove is connected to the program",
        '{"type": "MW_STATUS", "data": 3}': None,
        "Tracking:1:2": None,
        "[" * 5000: None,
    }
    assert {answer: state_in(answer) for answer in told} == told


def test_an_address_without_a_port_is_refused() -> None:
    with pytest.raises(ValueError, match="HOST:PORT"):
        TouchDiver.at("somewhere", MATERIALS)


def worn(service):
    (found,) = status(service)["worn"].values()
    return found


async def until_program(claim, move=None):
    """Go on moving, if a move is given, until the program shows it."""
    gives_up_at = time.monotonic() + 60.0 * PACE
    while not claim():
        assert time.monotonic() < gives_up_at, "the program shows nothing of it"
        if move is not None:
            await move()
        await asyncio.sleep(0.02)
