"""Stands in for the engine of Intiface Central, with two devices."""

from __future__ import annotations

import contextlib
import json
import threading
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

# The fields of each message besides `Id`, by the schema of Buttplug 4. The maker's own client,
# buttplug 1.0.0 of PyPI, reads all that this one sends, and works with the stand-in (2026-11-28).
FIELDS: dict[str, set[str]] = {
    "RequestServerInfo": {"ClientName", "ProtocolVersionMajor", "ProtocolVersionMinor"},
    "RequestDeviceList": set(),
    "StartScanning": set(),
    "Ping": set(),
    "OutputCmd": {"DeviceIndex", "FeatureIndex", "Command"},
    "StopCmd": {"Inputs", "Outputs"},
}
PAD = {"0": {"Vibrate": [0, 20]}, "1": {"Vibrate": [0, 100]}, "2": {"Rotate": [-20, 20]}}
WARMER = {"0": {"Temperature": [-10, 10]}}


def device(index: int, name: str, features: dict[str, dict[str, list[int]]]) -> dict[str, Any]:
    return {
        "DeviceName": name,
        "DeviceIndex": index,
        "DeviceMessageTimingGap": 0,
        "DeviceFeatures": {
            number: {
                "FeatureIndex": int(number),
                "FeatureDescription": "",
                "Output": {kind: {"Value": limits} for kind, limits in output.items()},
            }
            for number, output in features.items()
        },
    }


class IntifaceEngine:
    """The engine: what each feature of its devices does now, by the messages."""

    def __init__(self, port: int = 0, *, answers: bool = True) -> None:
        self.devices = {"3": device(3, "Pad", PAD), "5": device(5, "Warmer", WARMER)}
        self.now: dict[tuple[int, int, str], int] = {}
        self.asked: list[str] = []
        self.wrong: list[Any] = []
        self.ended = 0
        self.connection: ServerConnection | None = None
        self._answers = answers
        self.server = serve(self._run, "127.0.0.1", port)
        self.port = self.server.socket.getsockname()[1]
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def close(self) -> None:
        self.server.shutdown()
        if self.connection is not None:
            self.connection.close()

    def has_started(self) -> bool:
        return "StartScanning" in self.asked or not self._answers

    def vibrates(self) -> bool:
        return self.value(3, 0, "Vibrate") > 0

    def rests(self) -> bool:
        return not any(self.now.values())

    def value(self, *key: Any) -> int:
        return self.now.get(key, 0)

    def list_devices(self, request: int = 0) -> None:
        assert self.connection is not None
        listed = {"DeviceList": {"Id": request, "Devices": self.devices}}
        self.connection.send(json.dumps([listed]))

    def _run(self, connection: ServerConnection) -> None:
        self.connection = connection
        with contextlib.suppress(ConnectionClosed):
            while True:
                for each in json.loads(connection.recv()):
                    ((kind, body),) = each.items()
                    self._take(kind, body)
        self.now.clear()
        self.ended += 1

    def _take(self, kind: str, body: dict[str, Any]) -> None:
        number = body.pop("Id")
        if body.keys() != FIELDS.get(kind) or number < 1:
            self.wrong.append((kind, body))
        self.asked.append(kind)
        if kind == "StopCmd":
            self.now.clear()
        elif kind == "OutputCmd":
            ((output, value),) = body["Command"].items()
            index, feature = body["DeviceIndex"], body["FeatureIndex"]
            limits = self.devices[str(index)]["DeviceFeatures"][str(feature)]["Output"][output]
            if not limits["Value"][0] <= value["Value"] <= limits["Value"][1]:
                self.wrong.append((kind, body))
            self.now[index, feature, output] = value["Value"]
        if self._answers:
            self._answer(kind, number)

    def _answer(self, kind: str, number: int) -> None:
        if kind == "RequestDeviceList":
            self.list_devices(number)
            return
        answer: dict[str, Any] = {"Ok": {"Id": number}}
        if kind == "RequestServerInfo":
            version = {"ProtocolVersionMajor": 4, "ProtocolVersionMinor": 0}
            told = {"ServerName": "Stand-in", "MaxPingTime": 1000, **version}
            answer = {"ServerInfo": {"Id": number, **told}}
        assert self.connection is not None
        self.connection.send(json.dumps([answer]))
