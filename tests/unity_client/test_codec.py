"""The C# codec against the golden vectors that the Python service writes and reads."""

import json
from pathlib import Path

import msgpack
import pytest

from hapticvlm import messages

pytest_plugins = ("mono_build",)
VECTORS = Path(__file__).parents[2] / "schemas" / "vectors"
FUZZED = 100_000


def vectors(*names):
    cases = [case for name in names for case in json.loads((VECTORS / f"{name}.json").read_text())]
    return [case for case in cases if "msgpack" in case]


def echoed(build, cases):
    given = "\n".join(case["msgpack"] for case in cases)
    lines = build.run("programs.exe", "echo", text=given + "\n").splitlines()
    return [line.split("\t") for line in lines]


@pytest.fixture(scope="module")
def golden(build):
    cases = vectors("accepted", "answers")
    assert len(cases) > 30
    return list(zip(cases, echoed(build, cases), strict=True))


def test_every_golden_vector_is_decoded_to_its_value(golden):
    for case, (_, shown) in golden:
        assert json.loads(shown) == case["value"], case["name"]


def test_generated_types_write_what_the_service_itself_would(golden):
    for case, (typed, _) in golden:
        data = bytes.fromhex(case["msgpack"])
        if msgpack.unpackb(data)["type"] in messages._CHOICES["type"]:
            canonical = messages.encode(messages.decode(data), as_text=False)
            assert isinstance(canonical, bytes)
            data = canonical
        assert typed == data.hex(), case["name"]


def test_10_000_objects_are_added_in_less_than_100_ms_and_each_that_goes_costs_its_id(
    build, capsys
):
    output = build.run("programs.exe", "large", "10000").split()
    added_ms, removed_ms, size = (float(value) for value in output[1::2])
    with capsys.disabled():
        print(
            f"\n10,000 objects: {added_ms} ms of CPU, 5,000 removed: {removed_ms} ms, {size} bytes"
        )
    assert added_ms < 100.0
    assert removed_ms < 100.0
    assert size < 40 * 5000


def test_malformed_bytes_are_refused(build):
    cases = [case for case in vectors("refused") if not case["id"]]
    broken = ("nothing", "a truncated map", "trailing bytes", "a declared length", "not UTF-8")
    for case, answer in zip(cases, echoed(build, cases), strict=True):
        if any(word in case["name"] for word in broken):
            assert answer[0] == "refused", case["name"]


def test_unknown_fields_and_unknown_choices_are_passed_over(build):
    error = {"type": "error", "id": 7, "code": "new_code", "text": "t", "later": [{"a": 1}, b"x"]}
    skipped = {"later": {"deep": [1.5]}, "type": "skipped", "id": 3, "reason": "rate"}
    cases = [{"msgpack": msgpack.packb(value).hex()} for value in (skipped, error)]
    known, unknown = echoed(build, cases)
    assert msgpack.unpackb(bytes.fromhex(known[0])) == {
        "type": "skipped",
        "id": 3,
        "reason": "rate",
    }
    assert unknown == [
        "refused",
        "ErrorCode is not set",
    ]  # decoded as Other, never encoded


def test_100_000_fuzzed_inputs_raise_only_the_codec_s_own_error(build):
    given = "\n".join(
        case["msgpack"] for case in vectors("accepted", "answers", "refused") if case["msgpack"]
    )
    output = build.run("programs.exe", "fuzz", str(FUZZED), "1", text=given + "\n")
    fine, refused = int(output.split()[1]), int(output.split()[3])
    assert fine + refused == FUZZED
    assert min(fine, refused) > 1000
