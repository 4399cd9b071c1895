"""A study led through a real service on simulated devices: what is kept, stopped and refused."""

import asyncio
import contextlib
import json
import os
import subprocess
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from null_sink import KINDS, NAME, null_sink
from pace import PACE
from websockets.asyncio.client import connect as open_socket

from hapticvlm import documents
from hapticvlm.client import Client, Refused, connect
from hapticvlm.client.local_service import Service, running
from hapticvlm_studio.design import design as designs
from hapticvlm_studio.design import form as forms
from hapticvlm_studio.design.design import Design, Plan
from hapticvlm_studio.design.patterns import paper_like
from hapticvlm_studio.design.stimuli import StudyError
from hapticvlm_studio.trials import record
from hapticvlm_studio.trials.conductor import ANSWER_S, Conductor
from hapticvlm_studio.trials.page_server import Setting, run
from hapticvlm_studio.trials.player import SILENT, Player
from hapticvlm_studio.trials.record import Pace

pytestmark = pytest.mark.process

LONG_S = 8.0
PATIENCE_S = 120.0 * PACE


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
        each_s = design.stimuli[0].lead_s + LONG_S + ANSWER_S
        assert conductor.view()["seconds_left"] == pytest.approx(3 * each_s)
        await conductor.leave()
    async with conducting(service, design, tmp_path) as conductor:
        await conductor.do({"do": "choose", "participant": "ann"})
        assert conductor.view()["answered"] == 1


async def test_a_page_hears_of_an_answer_once_it_is_on_the_disk(
    service: Service, design: Design, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flushed, told, fsync = [0], [(0, 0)], os.fsync  # answers on the disk; shown, and on the disk

    def flush(descriptor: int) -> None:
        fsync(descriptor)
        flushed.append(kinds(tmp_path).count("answered"))

    monkeypatch.setattr(os, "fsync", flush)
    async with conducting(service, design, tmp_path) as conductor:
        conductor.notify = lambda: told.append((conductor.view().get("answered", 0), flushed[-1]))
        await begin(conductor)
        await conductor.do({"do": "answer", "trial": 0, "pattern": design.stimuli[0].name})
        await until(lambda: told[-1][0])
    assert all(shown <= kept for shown, kept in told)


async def test_the_time_left_of_the_training_falls_with_each_pattern_felt(
    service: Service, design: Design, tmp_path: Path
) -> None:
    brief = tuple(replace(each, seconds=0.2) for each in design.stimuli)
    training = designs.design(brief, ["ann"], Plan(repeats=2, renderings=3))
    designs.write_design(tmp_path, training)
    each_s = [stimulus.lead_s + stimulus.seconds for stimulus in brief]
    async with conducting(service, training, tmp_path) as conductor:
        await conductor.do({"do": "choose", "participant": "ann"})
        assert conductor.view()["seconds_left"] == pytest.approx(3 * sum(each_s))
        await conductor.do({"do": "feel", "pattern": brief[0].name})
        await until(lambda: conductor.view()["renderings"])
        assert conductor.view()["seconds_left"] == pytest.approx(3 * sum(each_s) - each_s[0])


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


@pytest.mark.nightly
@pytest.mark.needs_toolchain("pulseaudio", "pipewire")
@pytest.mark.parametrize("kind", KINDS)
async def test_a_muted_output_halts_the_study_in_words_and_its_trial_comes_again(
    design: Design, tmp_path: Path, kind: str
) -> None:
    def mute(is_muted: str) -> None:
        subprocess.run(["pactl", "set-sink-mute", "@DEFAULT_SINK@", is_muted], check=True)

    def tried(kind: str) -> list[tuple[int, int]]:
        events = [each for each in record.events(tmp_path, "ann") if each["event"] == kind]
        return [(event["trial"], event["attempt"]) for event in events]

    long = tuple(replace(each, seconds=10.0, repeats=9) for each in design.stimuli)
    phases: list[str] = []
    with null_sink(kind=kind), running(["--speaker", NAME]) as service:
        async with conducting(service, replace(design, stimuli=long), tmp_path) as conductor:
            conductor.notify = lambda: phases.append(conductor.phase)
            await begin(conductor)
            mute("1")
            await until(lambda: "trouble" in phases)
            assert "muted" in str(conductor.view()["trouble"])
            await conductor.do({"do": "begin"})
            phases.clear()
            await until(lambda: "trouble" in phases)  # still muted: nothing more is presented
            assert tried("presented") == tried("spoiled") == [(0, 1)]
            mute("0")
            await until(lambda: not conductor.overview()["outputs"]["faults"])
            await conductor.do({"do": "begin"})
            await until(lambda: conductor.phase == "asking")
            assert tried("presented") == [(0, 1), (0, 2)]
            assert not tried("played")


async def test_trouble_after_the_last_answer_does_not_keep_a_participant_from_the_end(
    service: Service, design: Design, tmp_path: Path
) -> None:
    last = replace(design.stimuli[0], seconds=1.5)
    one = replace(design, stimuli=(last,), trials={"ann": (last.name,)})
    clients: list[Client] = []
    async with conducting(service, one, tmp_path, clients) as conductor:
        await clients[0].set(vibration_gain=0.0)
        await begin(conductor)
        await conductor.do({"do": "answer", "trial": 0, "pattern": last.name})
        await until(lambda: conductor.phase == "trouble")
        await clients[0].set(vibration_gain=1.0)  # it stays set for the next owner
        await conductor.do({"do": "begin"})

        assert conductor.phase == "done"
        assert conductor.view()["trouble"] is None
        with pytest.raises(StudyError, match="nothing to begin"):
            await conductor.do({"do": "begin"})


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


FORM = """
languages = ["en", "de"]
consent = { en = "You will feel.", de = "Sie spueren." }
rate = "every trial"
[[question]]
name = "age"
kind = "number"
text = { en = "Age?", de = "Alter?" }
[[rating]]
name = "real"
text = { en = "Real?", de = "Echt?" }
low = { en = "no", de = "nein" }
high = { en = "yes", de = "ja" }
"""


async def test_consent_and_questions_come_first_and_each_answer_is_rated(
    service: Service, design: Design, tmp_path: Path
) -> None:
    short = tuple(replace(each, seconds=0.2, lead_s=0.3) for each in design.stimuli)
    form = forms.revive(documents.parse_toml(FORM))
    asked = replace(design, stimuli=short, trials={"ann": design.trials["ann"][:1]}, form=form)
    async with conducting(service, asked, tmp_path) as conductor:
        await conductor.do({"do": "choose", "participant": "ann"})
        with pytest.raises(StudyError, match="asked first"):
            await conductor.do({"do": "begin"})
        await conductor.do({"do": "agree", "language": "de"})
        with pytest.raises(StudyError, match="no question 'name'"):
            await conductor.do({"do": "tell", "answers": {"name": "Ann"}})
        await conductor.do({"do": "tell", "answers": {"age": 31}})
        await conductor.do({"do": "begin"})
        await until(lambda: conductor.phase == "asking")
        await conductor.do({"do": "answer", "trial": 0, "pattern": short[0].name})
        await until(lambda: conductor.phase == "rating")
        await conductor.do({"do": "pause"})
        await conductor.leave()
    async with conducting(service, asked, tmp_path) as conductor:
        await conductor.do({"do": "choose", "participant": "ann"})
        assert (conductor.phase, conductor.view()["language"]) == ("ready", "de")
        await conductor.do({"do": "begin"})
        await until(lambda: conductor.phase == "rating")
        with pytest.raises(StudyError, match="needs 1 to 7"):
            await conductor.do({"do": "rate", "trial": 0, "ratings": {"real": 9}})
        await conductor.do({"do": "rate", "trial": 0, "ratings": {"real": 6}})
        await until(lambda: conductor.phase == "done")
    events = {event["event"]: event for event in record.events(tmp_path, "ann")}
    assert events["agreed"]["language"] == "de"
    assert events["told"]["answers"] == {"age": 31}
    assert events["rated"]["ratings"] == {"real": 6}


async def test_a_pilot_is_heard_and_only_the_experimenter_sees_the_pattern(
    service: Service, design: Design, tmp_path: Path
) -> None:
    told: asyncio.Future[str] = asyncio.get_running_loop().create_future()
    setting = Setting(tmp_path, service.url, pace=Pace(rest_s=0.0, hear=True), settle_c=30.0)
    study = asyncio.create_task(run(design, setting, told.set_result))
    try:
        page = await asyncio.wait_for(told, PATIENCE_S)
        url = page.replace("http://", "ws://").removesuffix("study.html")
        async with (
            asyncio.timeout(PATIENCE_S),
            open_socket(url, proxy=None) as seat,
            open_socket(url + "experimenter", proxy=None) as desk,
        ):
            for do in ({"do": "choose", "participant": "ann"}, {"do": "begin"}):
                await seat.send(json.dumps(do))
            overview: dict[str, object] = {}
            while overview.get("phase") != "asking" or "plate_c" not in overview["outputs"]:  # type: ignore[operator]
                overview = json.loads(await desk.recv())
            assert overview["next_trial"] == design.trials["ann"][0]
            loudest = 0.0
            plates_c: list[float] = []
            while loudest < 0.01 or not plates_c:
                message = json.loads(await seat.recv())
                assert "next_trial" not in message
                plates_c += [message["plate_c"]] if message.get("plate_c") else []
                loudest = max(
                    loudest, *map(abs, message.get("waveform", {"samples": [0.0]})["samples"])
                )
            assert all(18.0 <= plate_c <= 40.0 for plate_c in plates_c)
    finally:
        study.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await study
