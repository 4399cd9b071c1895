"""Checks the example messages and the links of README and docs."""

import re
from pathlib import Path

import pytest
from conftest import peer

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
