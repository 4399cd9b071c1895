"""The browser client's codec against the golden vectors and Python's msgpack, in node."""

import json
import math
import os
import random
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgpack
import pytest

ROOT = Path(__file__).parents[2]
CODEC = ROOT / "examples" / "webxr" / "msgpack.js"
CHECK = Path(__file__).parent / "vectors.mjs"
FUZZED = 100_000
RANDOM_DOCUMENTS = 1_000
NODE_S = 300.0


def golden() -> Iterator[tuple[str, bytes]]:
    """Every message of the golden vectors that has MessagePack bytes."""
    for file in ("accepted", "answers"):
        for vector in json.loads((ROOT / f"schemas/vectors/{file}.json").read_text()):
            if "msgpack" in vector:
                yield vector["name"], bytes.fromhex(vector["msgpack"])


def random_value(source: random.Random, depth: int = 0) -> Any:
    """Anything the protocol's MessagePack can hold."""
    kind = source.randrange(9 if depth < 4 else 7)
    length = source.choice([0, 1, 5, 15, 16, 31, 32, 255, 256, 70_000 if depth == 0 else 3])
    if kind < 3:
        scalars = (None, source.random() < 0.5, source.uniform(-1e9, 1e9), float(length), -0.0)
        return source.choice([*scalars, math.inf, 5e-324])
    if kind < 5:
        return source.choice([1, -1]) * source.getrandbits(source.randrange(1, 54))
    if kind == 5:
        return "".join(source.choice("a\u00e9\u4e2d\U0001f600\ufeff\x00") for _ in range(length))
    if kind == 6:
        return source.randbytes(length)
    count = source.choice([0, 2, 15, 16])
    if kind == 7:
        return [random_value(source, depth + 2) for _ in range(count)]
    return {f"key{i}": random_value(source, depth + 2) for i in range(count)}


def shown(value: Any) -> Any:
    """What JSON can say of a value, whole floats and bytes told apart."""
    if isinstance(value, float):
        return {"$float": repr(value).replace("inf", "Infinity")}
    if isinstance(value, bytes):
        return {"$bin": value.hex()}
    if isinstance(value, dict):
        return {name: shown(part) for name, part in value.items()}
    return [shown(part) for part in value] if isinstance(value, list) else value


def check(documents: list[tuple[str, bytes]], fuzzed: int) -> Any:
    """Let node compare them; return what it counted."""
    node = shutil.which("node")
    if node is None:
        message = "no node: apt-get install --no-install-recommends nodejs"
        if os.environ.get("CI"):
            pytest.fail(message)
        pytest.skip(message)
    told = [
        {"name": name, "msgpack": data.hex(), "value": shown(msgpack.unpackb(data))}
        for name, data in documents
    ]
    ran = subprocess.run(
        [node, str(CHECK), CODEC.as_uri(), str(fuzzed)],
        input=json.dumps({"documents": told, "seed": 7}),
        capture_output=True,
        text=True,
        timeout=NODE_S,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


def test_golden_vectors_are_encoded_byte_for_byte_and_fuzzed_ones_raise_only_the_codecs_error():
    vectors = list(golden())
    counted = check(vectors, FUZZED)
    print(counted)
    assert counted["documents"] == len(vectors) > 30
    assert counted["decoded"] + counted["refused"] == FUZZED
    assert counted["decoded"] > 1000
    assert counted["refused"] > 1000


def test_random_documents_are_encoded_as_pythons_msgpack_does():
    source = random.Random(11)
    documents = [
        (f"random {i}", msgpack.packb(random_value(source))) for i in range(RANDOM_DOCUMENTS)
    ]
    assert check(documents, 0)["documents"] == RANDOM_DOCUMENTS
