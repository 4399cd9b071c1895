"""Tests that files that are too large, too deep or missing give errors that can be shown."""

import errno
import io
import json
import os
import tomllib
import zipfile
from pathlib import Path

import pytest
from each_case import each_row
from PIL import Image

from hapticvlm import documents
from hapticvlm.captures.lines import CaptureError, read_lines
from hapticvlm.commands import config_file
from hapticvlm.devices.speaker.audio import WavFile
from hapticvlm.vision.galleries import storage

DEEP = {
    "array": "a = " + "[" * 5000,
    "table": "[" + "a." * 20_000 + "b]",
    "key": "a." * 20_000 + "b = 1",
    "integer": "a = " + "9" * 5000,
}


@pytest.mark.parametrize("kind", DEEP)
def test_toml_that_would_end_the_parser_is_refused(kind, tmp_path):
    with pytest.raises(tomllib.TOMLDecodeError):
        documents.parse_toml(DEEP[kind])
    file = tmp_path / "config.toml"
    file.write_text(DEEP[kind])
    with pytest.raises(ValueError, match="not TOML"):
        config_file.read(file)


def test_lists_of_numbers_are_no_keys_of_many_parts():
    text = "a = [\n" + ", ".join(["0.5"] * 400) + "\n]\n[b.c]\nd = 1.5\n"
    assert len(documents.parse_toml(text)["a"]) == 400


def test_json_that_is_nested_too_deep_is_refused(tmp_path):
    with pytest.raises(ValueError, match="too deep"):
        documents.parse_json("[" * 100_000)
    (tmp_path / "capture.jsonl").write_text("[" * 100_000)
    with pytest.raises(CaptureError):
        read_lines(tmp_path / "capture.jsonl")


def test_a_capture_that_is_no_text_is_blamed_by_name(tmp_path):
    (tmp_path / "capture.jsonl").write_bytes(b"\xff\xfe")
    with pytest.raises(CaptureError, match="UTF-8"):
        read_lines(tmp_path / "capture.jsonl")


def test_a_file_is_read_up_to_its_limit_and_no_byte_beyond(tmp_path):
    (tmp_path / "file").write_bytes(bytes(10))
    assert documents.read_bytes(tmp_path / "file", 10) == bytes(10)
    with pytest.raises(ValueError, match="larger than 9 bytes"):
        documents.read_bytes(tmp_path / "file", 9)


def test_a_gallery_that_unfolds_to_gigabytes_is_refused_before_it_does(tmp_path):
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("encoder.npy", bytes(1000))
        archive.filelist[0].file_size = 9 * 2**27  # as the directory of a real one states it
    with pytest.raises(storage.GalleryError, match="unpacks to"):
        storage.read_gallery(path)


def test_a_zip_of_an_unknown_method_is_no_gallery(tmp_path):
    path = tmp_path / "odd.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("encoder.npy", b"x")
    data = path.read_bytes().replace(
        b"PK\x01\x02\x14\x03\x14\x00\x00\x00\x00\x00", b"PK\x01\x02\x14\x03\x14\x00\x00\x00\x63\x00"
    )
    path.write_bytes(data)
    with pytest.raises(storage.GalleryError):
        storage.read_gallery(path)


@each_row(
    ("fault", "words"),
    [
        (lambda: dict[str, str]()["materials"], "`materials` is missing"),
        (lambda: json.loads("1") < "x", "a value is of the wrong kind"),
        (lambda: json.loads("null").items(), "a value is of the wrong kind"),
        (lambda: int(float("inf")), "a number is too large"),
        (lambda: b"a\xff".decode(), "byte 2 is not UTF-8 text; save it as UTF-8"),
        (lambda: "UTF-16".encode("utf-16").decode(), "byte 1 is not UTF-8 text; save it as UTF-8"),
        (lambda: b"\xff\xd8\xff\xe0".decode(), "a JPEG picture, and not text"),
        (lambda: b"\0\1\xff".decode(), "a binary file, and not text"),
        (lambda: Path("/no/such/file").read_bytes(), "No such file or directory"),
        (lambda: Image.open(io.BytesIO(b"x")), "cannot identify image file"),
        (lambda: documents.parse_json("[" * 100_000), "nested too deep"),
    ],
)
def test_a_fault_of_a_file_is_said_in_plain_words(fault, words):
    try:
        fault()
    except Exception as error:  # noqa: BLE001 - each row another
        caught = error
    assert documents.reason(caught) == words


def test_a_file_is_read_as_its_type_and_a_wrong_field_is_named(tmp_path):
    table, facts = tmp_path / "a.toml", tmp_path / "a.json"
    table.write_text("[plate]\nlag_s = 0.3\n")
    facts.write_text('{"plate": {"lag_s": "late"}}')
    kind = dict[str, dict[str, float]]
    assert documents.read_toml(table, kind) == {"plate": {"lag_s": 0.3}}
    with pytest.raises(ValueError, match="Expected `float`, got `str`"):
        documents.read_json(facts, kind)
    for reader, form in ((documents.read_toml, "not TOML"), (documents.read_json, "not JSON")):
        facts.write_text("{")
        with pytest.raises(ValueError, match=form):
            reader(facts, kind)
        with pytest.raises(ValueError, match="larger than"):
            reader(table, kind, 4)


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS])
def test_a_file_is_written_where_the_file_system_locks_nothing(number, monkeypatch, tmp_path):
    fcntl = pytest.importorskip("fcntl", reason="file locks of this kind are of Unix")

    def flock(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "flock", flock)  # no such file system can be mounted here
    file = WavFile(tmp_path / "a.wav")
    file.close()
    assert (tmp_path / "a.wav").stat().st_size > 0
