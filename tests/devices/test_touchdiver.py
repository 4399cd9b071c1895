"""A TouchDIVER, as the maker's program sees it: nobody here has worn one."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from conftest import peer
from glove_program import GloveProgram
from pace import until
from scene_client import owner_of
from worn_outputs import shown

from hapticvlm.client.local_service import Service, running
from hapticvlm.devices.worn.touchdiver import POINTS, TEXTURES, changes, state_in
from hapticvlm.materials import MATERIALS

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


@pytest.fixture(scope="module")
def program() -> Iterator[GloveProgram]:
    program = GloveProgram()
    yield program
    program.close()


@pytest.fixture(scope="module")
def service(program: GloveProgram) -> Iterator[Service]:
    with running(["--hand", f"weart=127.0.0.1:{program.port}"]) as service:
        until(lambda: program.has_started())
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


async def test_a_slide_is_felt_as_its_material_and_a_release_rests_the_glove(program, service):
    async with peer(service) as client:
        await owner_of(client)
        await client.touch("contact", "table")

        async def slide() -> None:
            await client.touch("slide", "table", speed_mps=0.2, force_n=2.5)

        await shown(lambda: program.fields("texture")[:1] == ["12"], slide)
        assert program.fields("texture")[3] == "0.20"
        assert program.fields("force") == ["0.50", "0.0", "0.0"]
        assert {hand for _, hand, _ in list(program.now)} == {"RIGHT"}
        await client.touch("release")
        await shown(lambda: not program.kinds() & {"texture", "force"})


async def test_cold_metal_cools_the_hand_that_touches_it(program, service):
    async with peer(service) as client:
        await owner_of(client)

        async def hold() -> None:
            await client.touch("contact", "kettle")

        await shown(lambda: float((program.fields("temperature") or ["1"])[0]) < 0.3, hold)
        await client.touch("release")
        await shown(lambda: not program.kinds())


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
