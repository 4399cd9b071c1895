"""The command line starts at once and reports an error in one line."""

import argparse
import csv
import shlex
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from pace import PACE

from hapticvlm.commands.main import FOR_DEVELOPERS, MODULES, PARTS, _guarded, command_line, main


def test_a_command_imports_nothing_of_the_others():
    parse = "import hapticvlm.commands.main as c; c.command_line('serve')"
    script = f"{parse}; import sys; print(*[m for m in sys.modules if m.startswith('hapticvlm')])"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    loaded = set(done.stdout.split())
    assert "hapticvlm.commands.serve" in loaded
    assert not {"hapticvlm.commands.recognise", "hapticvlm_studio", "hapticvlm_lab"} & loaded


def test_each_command_declares_itself_alone():
    for name in (*MODULES, *(word for brought in PARTS.values() for word in brought)):
        parser: Any = command_line(name)  # argparse tells its commands to nobody
        (parts,) = parser._subparsers._group_actions
        assert name in parts.choices
        assert len(parts.choices) <= 3


def command(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "hapticvlm", *arguments],
        capture_output=True,
        text=True,
        check=False,
        timeout=60 * PACE,
    )


# What people type, and what the one line that answers it must name: what was wrong, or the cure.
WRONG_USES = Path(__file__).with_name("wrong_uses.csv")


def test_each_wrong_use_is_answered_in_one_line_that_names_the_cure(tmp_path, capsys):
    with WRONG_USES.open(newline="", encoding="utf-8") as file:
        uses = list(csv.reader(file))
    offenders = []
    for use, named in uses:
        try:
            code: object = main(shlex.split(use.replace("nosuch", str(tmp_path / "nosuch"))))
        except SystemExit as end:
            code = end.code
        said = capsys.readouterr().err.replace(str(tmp_path / "nosuch"), "nosuch")
        is_one_line = said.startswith("hapticvlm") and said.count("\n") == 1
        if code != 2 or not is_one_line or named not in said:
            offenders.append((use, code, said))
    assert offenders == []


@pytest.mark.parametrize("words", [("serve",), ("plate", "simulate")])
def test_a_taken_port_is_said_in_one_line(words):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = str(other.getsockname()[1])
        done = command(*words, "--port", port)
    assert done.returncode == 2
    assert f"port {port} is in use" in done.stderr
    assert "--port 0" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_bare_call_prints_the_overview(capsys):
    assert main([]) == 0
    assert "serve" in capsys.readouterr().out


def test_the_folder_that_demo_or_record_printed_is_what_replay_takes(tmp_path):
    from hapticvlm.recordings.session_log import newest_session

    for made in ("session/2026-01-31-120000-1", "session/2026-02-01-120000-1"):
        (tmp_path / made).mkdir(parents=True)
        (tmp_path / made / "session.jsonl").touch()
    newest = tmp_path / "session" / "2026-02-01-120000-1"
    for folder in (tmp_path, tmp_path / "session", newest):
        assert newest_session(folder) == newest


def test_the_overview_lists_what_only_developers_need_under_a_heading_of_its_own(capsys):
    main([])
    for_all, for_developers = capsys.readouterr().out.split("commands for developers:")
    for name in FOR_DEVELOPERS:
        assert f"  {name} " in for_developers
        assert f"  {name} " not in for_all
    assert "  serve " in for_all


@pytest.mark.parametrize(
    ("error", "is_memory"),
    [
        (MemoryError(), True),
        (RuntimeError("can't start new thread"), True),
        (ImportError("lib.so: failed to map segment from shared object"), True),
        (RuntimeError("a bug"), False),
        (ImportError("cannot import name x"), False),
    ],
)
def test_memory_that_is_used_up_is_one_line_and_a_bug_is_not(error, is_memory, capsys):
    def run(_):
        raise error

    options = argparse.Namespace(run=run, program="hapticvlm serve")
    if not is_memory:
        with pytest.raises(type(error)):
            _guarded(options)
        return
    assert _guarded(options) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("hapticvlm serve: ")
    assert "ulimit -v" in line
