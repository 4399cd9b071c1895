"""A minimal scene: describes objects, touches them, and prints the decisions.

Needs only `pip install websockets` and a running service (`hapticvlm serve`).
"""

import asyncio
import itertools
import json
import sys
import time
from typing import Any

import websockets

OBJECTS: list[dict[str, Any]] = [
    {"object_id": "table", "name": "Oak_Table_02"},
    {"object_id": "window", "name": "GlassPane"},
    {"object_id": "curtain", "name": "Curtain.001"},
    {"object_id": "kettle", "material": "metal", "temperature_c": 45.0},
]


class Service:
    """Sends requests and waits for their answers; prints decisions that arrive meanwhile."""

    def __init__(self, socket: websockets.ClientConnection) -> None:
        self.socket = socket
        self.ids = itertools.count(1)

    async def ask(self, **message: Any) -> dict[str, Any]:
        """Send one message and return the answer with its id."""
        id = next(self.ids)
        await self.socket.send(json.dumps({"id": id, **message}))
        while True:
            answer: dict[str, Any] = json.loads(await self.socket.recv())
            if answer["type"] == "decision":
                show(answer)
            if answer["type"] == "error" and answer["id"] == id:
                raise SystemExit(f"refused: {answer['text']}")
            if answer["type"] == "error":  # an event of a device or model, not an answer
                print("  the service reports:", answer["text"])
            if answer["id"] == id:
                return answer

    async def touch(self, phase: str, object_id: str, speed: float) -> None:
        """Say what the right hand does."""
        how = {"hand": "right", "speed_mps": speed, "force_n": 1.5, "captured_at": time.monotonic()}
        await self.ask(type="touch", phase=phase, object_id=object_id, **how)


def show(decision: dict[str, Any]) -> None:
    """Print the decision about an object."""
    what = f"{decision['material']} ({decision['confidence']:.0%}, from its {decision['source']})"
    print(f"  {decision['object_id']}: {what}, plate to {decision['setpoint_c']:.1f} degC")


async def main(url: str = "ws://127.0.0.1:8790/") -> None:
    """Stroke each object for half a second."""
    async with websockets.connect(url, compression=None) as socket:
        service = Service(socket)
        we = {"client": {"name": "touch.py", "version": "1"}, "protocol": {"major": 1, "minor": 0}}
        await service.ask(type="hello", **we, role="scene")
        await service.ask(type="scene", objects=OBJECTS, ambient_c=21.0, replace=True)
        for object_id in [stated["object_id"] for stated in OBJECTS]:
            print("touching", object_id)
            await service.touch("approach", object_id, 0.3)
            await asyncio.sleep(0.2)
            await service.touch("contact", object_id, 0.3)
            for _ in range(10):  # renew at 20 Hz; otherwise the lease ends after 250 ms
                await asyncio.sleep(0.05)
                await service.touch("slide", object_id, 0.1)
            await service.touch("release", object_id, 0.0)


if __name__ == "__main__":
    try:
        asyncio.run(main(*sys.argv[1:]))
    except OSError as error:
        sys.exit(f"no service there ({error}): `hapticvlm serve` starts one")
