"""How strong cold must be: people match a plate to a block of steel, and the service takes it."""

import asyncio
import io
import json
import sys
from pathlib import Path

import pytest

from hapticvlm.client import connect
from hapticvlm.client.local_service import Service
from hapticvlm.commands.main import main
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.server.options import thermal_strength
from hapticvlm_studio.commands import match

pytestmark = pytest.mark.process


async def fall_c(url: str) -> float:
    """Return how far the plate should fall for the block that is touched now, in degC."""
    async with connect(url) as client:
        steel = {"object_id": "block", "material": "metal", "temperature_c": 28.0}
        await client.scene([steel], ambient_c=28.0)
        await client.touch("contact", "block", force_n=1.0)
        while (event := await client.events.get())["type"] != "decision":
            pass
        return NEUTRAL_C - float(event["unlimited_c"])


def test_people_match_the_plate_to_steel_and_the_service_takes_their_median(
    service: Service,
    tmp_path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(match, "FELT_S", 0.05)
    monkeypatch.setattr(match, "REST_S", 0.0)
    kept = tmp_path / "cold.json"
    whole_c = asyncio.run(fall_c(service.url))

    def asked(code: str, percent: int, file: Path = kept) -> int:
        one = f"\nmuch less\n\n{percent}\n\n\n"  # two presentations and an answer nobody can use
        monkeypatch.setattr(sys, "stdin", io.StringIO(one * len(match.STARTS)))
        return main(["study", "match", str(file), "--participant", code, "--url", service.url])

    assert asked("P-01", 80) == 0
    assert asyncio.run(fall_c(service.url)) == pytest.approx(0.8 * whole_c, abs=0.01)
    assert asked("P-02", 50) == 0
    assert asked("P-03", 60) == 0
    assert "3 people, median 60 %" in capsys.readouterr().out

    told = json.loads(kept.read_text())
    assert told["matches"]["P-02"] == pytest.approx([0.5] * 4)
    assert told["simulated"] is True
    assert thermal_strength(str(kept)) == 0.6
    assert asked("P-02", 50) == 2
    assert "has P-02 already" in capsys.readouterr().err
    assert asked("P-04", 70, tmp_path / "gone" / "cold.json") != 0
    assert "P-04: 70 %, 70 %, 70 %, 70 %" in capsys.readouterr().out  # no answer is lost


def test_the_plate_waits_at_neutral_for_the_palm_before_it_plays_again(
    service: Service, tmp_path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in (("FELT_S", 1.5), ("REST_S", 0.0), ("STARTS", (1.0,))):
        monkeypatch.setattr(match, name, value)
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n100\n\n\n"))  # again at once
    asked = ["study", "match", str(tmp_path / "cold.json"), "--participant", "P-01", "--room", "10"]
    told: list[tuple[float, float]] = []  # plate and setpoint, degC

    async def watched() -> int:
        async with connect(service.url, role="observer") as client:
            study = asyncio.create_task(asyncio.to_thread(main, [*asked, "--url", service.url]))
            while not study.done():
                event = await client.events.get()
                if event["type"] == "telemetry":
                    told.append((event["plate_c"], event["setpoint_c"]))
            return await study

    assert asyncio.run(watched()) == 0
    cold = next(at for at, (plate_c, _) in enumerate(told) if plate_c < 28.0)
    neutral = next(at for at in range(cold, len(told)) if told[at][1] > 31.5)
    again = next(at for at in range(neutral, len(told)) if told[at][1] < 31.0)
    assert max(plate_c for plate_c, _ in told[neutral:again]) > 30.5, told  # of 31.2


def test_another_file_and_no_service_are_told_and_nothing_is_kept(
    tmp_path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "cold.json"
    path.write_text('{"calibrate": "plate"}')
    start = ["study", "match", str(path), "--participant", "P-01", "--url", "ws://127.0.0.1:9/"]
    assert main(start) == 2
    assert "give another file" in capsys.readouterr().err
    path.unlink()
    assert main(start) == 2
    assert "hapticvlm serve" in capsys.readouterr().err
    assert not path.exists()
