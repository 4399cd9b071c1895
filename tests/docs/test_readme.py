"""Checks the example messages and the links of README and docs."""

import re
import shlex
import sys
from pathlib import Path

import pytest
from conftest import peer

from hapticvlm.commands.main import main

ROOT = Path(__file__).parents[2]
PROTOCOL = (ROOT / "docs" / "protocol.md").read_text()
PAGES = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md")))


async def test_the_three_messages_that_connect_a_scene_are_answered_and_decided(service):
    (snippet,) = re.findall(r"```json\n(.*?)```", PROTOCOL, re.DOTALL)
    async with peer(service) as client:
        for line in snippet.splitlines():
            await client.socket.send(line)
        client.as_text = True
        kinds = [await client.read() for _ in range(4)]
    assert [kind["type"] for kind in kinds if kind["type"] != "telemetry"][:3] == [
        "welcome",
        "ok",
        "ok",
    ]
    (decision,) = [kind for kind in kinds if kind["type"] == "decision"]
    assert (decision["object_id"], decision["material"]) == ("table", "wood")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_to_a_file_leads_somewhere(page):
    for target in re.findall(r"\]\((?!http)([^)#]+)", page.read_text()):
        assert (page.parent / target).exists(), target


@pytest.mark.nightly
def test_every_command_for_a_study_runs_in_the_environment_that_the_readme_makes(
    tmp_path, monkeypatch, capsys
):
    for extra in ("matplotlib", "statsmodels", "pandas"):  # what `make demo` does not install
        monkeypatch.setitem(sys.modules, extra, None)
    monkeypatch.chdir(tmp_path)
    section = (ROOT / "README.md").read_text().partition("## You study")[2].partition("\n## ")[0]
    commands = re.findall(r"`hapticvlm ([^`]+)`", section)
    # The two others wait for people, or for their answers; tests/studio runs both.
    shown = [command for command in commands if not re.match(r"study (run|report DIR)", command)]
    assert len(shown) >= 6
    for command in shown:
        assert main(shlex.split(command)) == 0, (command, capsys.readouterr().err)
