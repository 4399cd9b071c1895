"""What the README shows must work as shown."""

import re
from pathlib import Path

from conftest import peer

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()


async def test_the_three_messages_that_connect_a_scene_are_answered_and_decided(service):
    (snippet,) = re.findall(r"```json\n(.*?)```", README, re.DOTALL)
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


def test_every_link_to_a_file_leads_somewhere():
    for document in (README, (ROOT / "CONTRIBUTING.md").read_text()):
        for target in re.findall(r"\]\((?!http)([^)#]+)", document):
            assert (ROOT / target).exists(), target
