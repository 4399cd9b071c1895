"""The smallest scene: say what the objects are, touch them, see what they will feel like.

Needs only `pip install websockets msgpack` and a running service (`hapticvlm serve`).
"""

import asyncio
import itertools
import sys
import time
from typing import Any

import msgpack
import websockets

OBJECTS: list[dict[str, Any]] = [
    {"object_id": "table", "name": "Oak_Table_02"},
    {"object_id": "window", "name": "GlassPane"},
    {"object_id": "curtain", "name": "Curtain.001"},
    {"object_id": "kettle", "material": "metal", "temperature_c": 45.0},
]


async def main(url: str = "ws://127.0.0.1:8790/") -> None:
    """Stroke each object for half a second."""
    ids = itertools.count(1)
    async with websockets.connect(url, compression=None) as socket:

        async def ask(**message: Any) -> dict[str, Any]:
            id = next(ids)
            await socket.send(msgpack.packb({"id": id, **message}))
            while True:
                answer: dict[str, Any] = msgpack.unpackb(await socket.recv())
                if answer["type"] == "decision":
                    print(
                        f"  {answer['object_id']}: {answer['material']} "
                        f"({answer['confidence']:.0%}, from its {answer['source']}), "
                        f"plate to {answer['setpoint_c']:.1f} degC"
                    )
                if answer["type"] == "error":
                    raise SystemExit(f"refused: {answer['text']}")
                if answer["id"] == id:
                    return answer

        client = {"name": "touch.py", "version": "1"}
        protocol = {"major": 1, "minor": 0}
        welcome = await ask(type="hello", client=client, protocol=protocol, role="scene")
        print("connected; owner of the outputs:", welcome["owner"])
        await ask(type="scene", objects=OBJECTS, ambient_c=21.0, replace=True)

        async def touch(phase: str, object_id: str, speed: float) -> None:
            hand = {"hand": "right", "captured_at": time.monotonic()}
            motion = {"speed_mps": speed, "force_n": 1.5}
            await ask(type="touch", phase=phase, object_id=object_id, **hand, **motion)

        for stated in OBJECTS:
            object_id = stated["object_id"]
            print("touching", object_id)
            await touch("approach", object_id, 0.3)
            await asyncio.sleep(0.2)
            await touch("contact", object_id, 0.3)
            for _ in range(10):  # renew at 20 Hz: without it the lease ends after 250 ms
                await asyncio.sleep(0.05)
                await touch("slide", object_id, 0.1)
            await touch("release", object_id, 0.0)


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
