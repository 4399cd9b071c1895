"""Checks the example messages, the links of README and docs, and the commands for a study."""

import re
import shlex
import sys
from pathlib import Path

import pytest
from conftest import peer
from each_case import each

from hapticvlm.commands.main import main

ROOT = Path(__file__).parents[2]
PROTOCOL = (ROOT / "docs" / "protocol.md").read_text()
PAGES = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md")))
LOG = ROOT / "service" / "hapticvlm_lab" / "LOG.md"


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


@each(page=[*PAGES, LOG])
def test_every_link_leads_to_a_file_and_to_a_heading_of_it(page):
    for target, anchor in re.findall(r"\]\((?!http)([^)#]*)#?([^)]*)\)", page.read_text()):
        path = page.parent / target if target else page
        assert path.exists(), target
        assert not anchor or anchor in anchors(path), (target, anchor)


def anchors(path):
    """The names by which a page's headings are linked."""
    titles = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    plain = (re.sub(r"[^\w\- ]", "", title.lower()) for title in titles)
    return {title.strip().replace(" ", "-") for title in plain}


@pytest.mark.nightly
def test_every_command_for_a_study_runs_in_the_environment_that_the_demo_makes(
    tmp_path, monkeypatch, capsys
):
    for extra in ("matplotlib", "scipy", "statsmodels", "pandas"):  # of the extra `studio`
        monkeypatch.setitem(sys.modules, extra, None)
    monkeypatch.chdir(tmp_path)
    pages = ("feel.md", "paper.md", "study.md", "tutorials/study.md")
    text = "\n".join((ROOT / "docs" / page).read_text(encoding="utf-8") for page in pages)
    commands = re.findall(r"^ *hapticvlm (.+)$|`hapticvlm ([^`]+)`", text, re.MULTILINE)
    # The others wait for people or their answers, which tests/studio has, or take minutes.
    others = r"(?:serve|study (?:run|match|report (?!--paper)|report$))"
    every = ["".join(command) for command in commands]
    shown = [command for command in every if not re.match(others, command)]
    assert len(shown) >= 5
    for command in shown:
        assert main(shlex.split(command)) == 0, (command, capsys.readouterr().err)
