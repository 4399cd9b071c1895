"""The browser scene's codec (@msgpack/msgpack) reads and writes the golden vectors, in node."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgpack
import pytest
from node_programs import printed

ROOT = Path(__file__).parents[2]
CODEC = ROOT / "examples/webxr/node_modules/@msgpack/msgpack/dist.esm/index.mjs"
CHECK = Path(__file__).parent / "vectors.mjs"


def golden() -> Iterator[tuple[str, bytes]]:
    """Every message of the golden vectors that has MessagePack bytes."""
    for file in ("accepted", "answers"):
        for vector in json.loads((ROOT / f"schemas/vectors/{file}.json").read_text()):
            if "msgpack" in vector:
                yield vector["name"], bytes.fromhex(vector["msgpack"])


def shown(value: Any) -> Any:
    """What JSON can say of a value, bytes told apart."""
    if isinstance(value, bytes):
        return {"$bin": value.hex()}
    if isinstance(value, dict):
        return {name: shown(part) for name, part in value.items()}
    return [shown(part) for part in value] if isinstance(value, list) else value


@pytest.mark.needs_toolchain("node", "@msgpack/msgpack")
def test_the_codec_reads_every_golden_vector_and_what_it_writes_means_the_same():
    vectors = list(golden())
    documents = [
        {"name": name, "msgpack": data.hex(), "value": shown(msgpack.unpackb(data))}
        for name, data in vectors
    ]
    answers = printed(CHECK, CODEC.as_uri(), cases=documents)
    written = [msgpack.unpackb(bytes.fromhex(text)) for text in answers]
    assert written == [msgpack.unpackb(data) for _, data in vectors]
    assert len(written) > 30
