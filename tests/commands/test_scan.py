"""`hapticvlm scan`: the real command on drawn scenes."""

import csv
import io
import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest
from gltf_room import SURFACES, glb, write_room
from in_process import hapticvlm
from pace import PACE

from hapticvlm import messages

NAMES = {surface.name for surface in SURFACES}


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    return write_room(tmp_path_factory.mktemp("scan") / "room.glb")


@pytest.fixture
def folder(tmp_path):
    """Two scenes in sub-folders, a broken one between them, and one that is hidden."""
    write_room(tmp_path / "a" / "room.glb")
    (tmp_path / "b.glb").write_bytes(b"glTF")
    write_room(tmp_path / "c" / "room.gltf")
    write_room(tmp_path / ".cache" / "room.glb")
    return tmp_path


def test_the_table_has_each_surface_and_ends_with_the_least_sure_and_a_summary(room):
    scanned = hapticvlm("scan", room)
    assert (scanned.code, scanned.err) == (0, "")
    head, *lines = scanned.out.splitlines()
    rows, (summary, *_) = lines[:20], lines[20:]
    assert head.split()[:3] == ["object", "surface", "material"]
    assert {row.split()[2] for row in rows} == {surface.material for surface in SURFACES}
    sureness = [float(row.split()[3]) for row in rows]
    assert sureness == sorted(sureness, reverse=True)
    assert "20 surfaces of 1 object" in summary


def test_json_is_one_object_for_each_scene(room):
    scanned = hapticvlm("scan", room, room, "--json")
    first, second = map(json.loads, scanned.out.splitlines())
    assert first == second
    assert first["file"] == str(room)
    assert first["counts"]["surfaces"] == len(first["surfaces"]) == 20
    by_name = {row["surface_name"]: row for row in first["surfaces"]}
    steel = by_name["Steel_Brushed"]
    assert (steel["object_id"], steel["material"], steel["source"]) == ("Room", "metal", "name")
    assert steel["contact_c"] < by_name["Wool_Carpet"]["contact_c"]


def test_csv_is_a_line_for_each_surface(room):
    rows = list(csv.DictReader(io.StringIO(hapticvlm("scan", room, "--csv").out)))
    assert len(rows) == 20
    assert {row["sureness"] for row in rows} == {"sure", "probable"}
    assert {row["surface"] for row in rows} == {str(index) for index in range(20)}


def test_a_name_that_a_spreadsheet_would_run_is_text(tmp_path):
    document = {
        "asset": {"version": "2.0"},
        "nodes": [{"name": '=HYPERLINK("http://x")', "mesh": 0}],
        "meshes": [{"primitives": [{}]}],
    }
    (tmp_path / "a.glb").write_bytes(glb(document))
    (row,) = csv.DictReader(io.StringIO(hapticvlm("scan", tmp_path, "--csv").out))
    assert row["object_id"].startswith("'=")


def test_the_messages_are_lines_that_a_service_accepts(room):
    (line,) = hapticvlm("scan", room, "--messages").out.splitlines()
    message = messages.decode(line)
    assert isinstance(message, messages.Scene)
    assert [each.object_id for each in message.objects] == ["Room"]


def test_a_broken_scene_does_not_stop_the_others(folder):
    scanned = hapticvlm("scan", folder)
    assert scanned.code == 1
    assert scanned.out.count("20 surfaces of 1 object") == 2
    (line,) = scanned.err.splitlines()
    assert "b.glb" in line
    as_json = hapticvlm("scan", folder, "--json")
    assert (as_json.code, as_json.err) == (1, "")
    rows = [json.loads(row) for row in as_json.out.splitlines()]
    assert [Path(row["file"]).relative_to(folder).as_posix() for row in rows] == [
        "a/room.glb",
        "b.glb",
        "c/room.gltf",
    ]
    assert ["error" in row for row in rows] == [False, True, False]


def test_what_could_not_be_read_of_a_scene_is_told_beside_its_table(tmp_path):
    path = write_room(tmp_path / "room.gltf")
    path.with_suffix(".bin").unlink()
    scanned = hapticvlm("scan", path)
    assert scanned.code == 0
    assert "20 surfaces of 1 object" in scanned.out
    assert "room.bin" in scanned.err
    assert len(json.loads(hapticvlm("scan", path, "--json").out)["notes"]) == 1


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["empty"], "no scene found"),
        (["gone.glb"], "gone.glb"),
        (["two", "--messages"], "--messages"),
        (["two", "--json", "--csv"], "--csv"),
    ],
)
def test_a_wrong_request_is_refused(arguments, word, tmp_path):
    (tmp_path / "empty").mkdir()
    for name in ("a", "b"):
        write_room(tmp_path / "two" / f"{name}.glb")
    refused = hapticvlm("scan", *arguments, cwd=tmp_path)
    assert (refused.code, refused.out) == (2, "")
    assert word in refused.err


@pytest.mark.process
def test_a_terminal_shows_progress_and_a_pipe_only_the_table(room):
    above, below = pty.openpty()
    command = [sys.executable, "-m", "hapticvlm", "scan", str(room)]
    scan = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=below)
    os.close(below)
    shown = b""
    with os.fdopen(above, "rb", buffering=0) as terminal:
        try:
            while piece := terminal.read(65536):
                shown += piece
        except OSError:  # the end of a terminal, on Linux
            pass
    table, _ = scan.communicate(timeout=60 * PACE)
    assert scan.returncode == 0
    assert b"room.glb" in shown
    assert table.startswith(b"object")
