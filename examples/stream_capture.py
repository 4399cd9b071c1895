"""Streams a recorded headset capture and prints each decision: a tool in a few lines.

`hapticvlm stream CAPTURE` does the same with a progress bar. Needs a running `hapticvlm serve`.
"""

import asyncio
import sys
from pathlib import Path

from hapticvlm import captures
from hapticvlm.client import connect
from hapticvlm.client.connection import Message
from hapticvlm.client.sending import stream
from hapticvlm.client.stream import describe


def show(line: captures.Line, answer: Message) -> None:
    """Print the answer to one line of the capture."""
    if answer["type"] == "decision":
        print(f"{line.t_s:6.2f} s  {describe(answer)}  (truth: {line.truth})")


async def main(path: str, url: str = "ws://127.0.0.1:8790/") -> None:
    """Stream the capture at its own pace."""
    async with connect(url, name="stream_capture.py") as client:
        outcome = await stream(client, captures.read(Path(path)), seen=show)
    print(f"{dict(outcome.sent)} sent, {dict(outcome.answers)} answered")


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
