"""A study led through a real service on simulated devices: what is kept, stopped and refused."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from websockets.asyncio.client import connect as open_socket
from websockets.exceptions import InvalidStatus

from hapticvlm.client import Client, Refused, connect
from hapticvlm.commands.local_service import Service
from hapticvlm.study import design as designs
from hapticvlm.study import record
from hapticvlm.study.conductor import Conductor
from hapticvlm.study.design import Design, Plan
from hapticvlm.study.patterns import paper_like
from hapticvlm.study.player import SILENT, Player
from hapticvlm.study.record import Pace
from hapticvlm.study.run import Setting, run
from hapticvlm.study.stimuli import StudyError

LONG_S = 8.0
PATIENCE_S = 120.0


@pytest.fixture
def design(tmp_path: Path) -> Design:
    """Two long patterns, so that an answer comes while they still play."""
    hot, *_, cold = paper_like()
    long = tuple(replace(each, seconds=LONG_S, repeats=1) for each in (hot, cold))
    made = designs.design(long, ["ann"], Plan(repeats=2, renderings=0))
    designs.write_design(tmp_path, made)
    return made


@asynccontextmanager
async def conducting(
    service: Service, design: Design, folder: Path, clients: list[Client] | None = None
) -> AsyncIterator[Conductor]:
    async with connect(service.url) as client:
        if clients is not None:
            clients.append(client)
        player = Player(client, settle_c=30.0)
        await player.prepare(design.stimuli)
        listening = asyncio.create_task(player.listen())
        conductor = Conductor(design, folder, player, Pace(rest_s=0.0))
        try:
            yield conductor
        finally:
            await conductor.leave()
            listening.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await listening


async def until(claim: Callable[[], object]) -> None:
    async with asyncio.timeout(PATIENCE_S):
        while not claim():  # noqa: ASYNC110 - the phase is polled as a page would see it
            await asyncio.sleep(0.02)


async def begin(conductor: Conductor) -> None:
    await conductor.do({"do": "choose", "participant": "ann"})
    await conductor.do({"do": "begin"})
    await until(lambda: conductor.phase == "asking")


def kinds(folder: Path) -> list[str]:
    return [event["event"] for event in record.events(folder, "ann")]


async def test_an_answer_is_kept_at_once_while_its_pattern_still_plays(
    service: Service, design: Design, tmp_path: Path
) -> None:
    async with conducting(service, design, tmp_path) as conductor:
        await begin(conductor)
        name = design.stimuli[0].name
        await conductor.do({"do": "answer", "trial": 0, "pattern": name, "seen_ms": 12.0})
        assert kinds(tmp_path) == ["opened", "trained", "presented", "answered"]
        await conductor.leave()
    async with conducting(service, design, tmp_path) as conductor:
        await conductor.do({"do": "choose", "participant": "ann"})
        assert conductor.view()["answered"] == 1


async def test_a_trial_takes_one_answer_to_itself(
    service: Service, design: Design, tmp_path: Path
) -> None:
    async with conducting(service, design, tmp_path) as conductor:
        await begin(conductor)
        answer = {"do": "answer", "trial": 0, "pattern": design.stimuli[0].name}
        with pytest.raises(StudyError, match="over"):
            await conductor.do({**answer, "trial": 1})
        with pytest.raises(StudyError, match="no pattern"):
            await conductor.do({**answer, "pattern": "nonsense"})
        await conductor.do(answer)
        with pytest.raises(StudyError, match="no trial is open"):
            await conductor.do(answer)
        assert kinds(tmp_path).count("answered") == 1


@pytest.mark.parametrize("is_answered", [False, True])
async def test_a_silent_speaker_halts_the_study_and_its_trial_does_not_count(
    service: Service, design: Design, tmp_path: Path, is_answered: bool
) -> None:
    short = tuple(replace(each, seconds=1.5) for each in design.stimuli)
    clients: list[Client] = []
    async with conducting(service, replace(design, stimuli=short), tmp_path, clients) as conductor:
        await clients[0].set(vibration_gain=0.0)
        await begin(conductor)
        if is_answered:
            await conductor.do({"do": "answer", "trial": 0, "pattern": short[0].name})
        await until(lambda: conductor.phase == "trouble")
        assert conductor.view()["trouble"] == SILENT
        assert kinds(tmp_path)[-1] == "spoiled"
        await clients[0].set(vibration_gain=1.0)
        await conductor.do({"do": "begin"})
        await until(lambda: conductor.phase == "asking")
        presented = [e for e in record.events(tmp_path, "ann") if e["event"] == "presented"]
        assert [event["trial"] for event in presented] == [0, 1 if is_answered else 0]
        await conductor.do({"do": "answer", **{k: presented[-1][k] for k in ("trial", "pattern")}})
        await until(lambda: "played" in kinds(tmp_path))


async def test_stop_rests_the_outputs_and_the_trial_comes_again(
    service: Service, design: Design, tmp_path: Path
) -> None:
    clients: list[Client] = []
    async with conducting(service, design, tmp_path, clients) as conductor:
        await begin(conductor)
        await conductor.do({"do": "stop"})
        with pytest.raises(Refused, match="held by stop"):
            await clients[0].touch("slide", design.stimuli[0].name)
        assert conductor.phase == "stopped"
        assert kinds(tmp_path)[-2:] == ["spoiled", "stopped"]
        await conductor.do({"do": "begin"})
        await until(lambda: conductor.phase == "asking")
        assert conductor.view()["answered"] == 0
        presented = [e for e in record.events(tmp_path, "ann") if e["event"] == "presented"]
        assert [event["attempt"] for event in presented] == [1, 2]


async def test_a_view_of_an_open_trial_does_not_tell_its_pattern(
    service: Service, design: Design, tmp_path: Path
) -> None:
    async with conducting(service, design, tmp_path) as conductor:
        await begin(conductor)
        first = conductor.view()
        await conductor.leave()
        one, two = (stimulus.name for stimulus in design.stimuli)
        other = {one: two, two: one}
        swapped = replace(
            design, trials={"ann": tuple(other[name] for name in design.trials["ann"])}
        )
        (tmp_path / "ann.jsonl").unlink()
    async with conducting(service, swapped, tmp_path) as conductor:
        await begin(conductor)
        assert conductor.view() == first


async def test_a_study_needs_the_outputs_for_itself(
    service: Service, design: Design, tmp_path: Path
) -> None:
    async with connect(service.url):
        with pytest.raises(StudyError, match="owns the outputs"):
            await run(design, Setting(tmp_path, service.url), print)


async def test_pages_of_other_origins_are_refused(
    service: Service, design: Design, tmp_path: Path
) -> None:
    told: asyncio.Future[str] = asyncio.get_running_loop().create_future()
    study = asyncio.create_task(run(design, Setting(tmp_path, service.url), told.set_result))
    try:
        page = await asyncio.wait_for(told, PATIENCE_S)
        url = page.replace("http://", "ws://").removesuffix("study.html")
        with pytest.raises(InvalidStatus):
            await open_socket(url, origin="https://evil.example", proxy=None)  # type: ignore[arg-type]
        async with open_socket(url, proxy=None) as socket:
            assert '"choosing"' in str(await socket.recv())
            for wrong in ("nonsense", "[]", "{}", '{"do": "answer", "trial": "x"}'):
                await socket.send(wrong)
                assert "refused" in str(await socket.recv())
    finally:
        study.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await study
