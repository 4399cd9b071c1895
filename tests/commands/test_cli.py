"""The command line starts at once and reports an error in one line."""

import argparse
import subprocess
import sys
from typing import Any

import pytest

from hapticvlm.commands.main import MODULES, PARTS, _guarded, command_line, main

HEAVY = ("torch", "transformers", "numpy", "scipy", "websockets", "msgspec")


def loaded_by(code):
    script = f"import sys; {code}; print([m for m in {HEAVY!r} if m in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=30
    )
    return done.stdout.strip().splitlines()[-1]


def test_importing_the_package_or_asking_for_help_loads_nothing_heavy():
    assert loaded_by("import hapticvlm") == "[]"
    asking = (
        "import contextlib, hapticvlm.commands.main as c\n"
        "with contextlib.suppress(SystemExit): c.main(['--help'])"
    )
    assert loaded_by(f"exec({asking!r})") == "[]"


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
        timeout=30,
    )


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["serve", "--host", "0.0.0.0"], "--token"),
        (["serve", "--peltier", "/dev/ttyUSB0"], "can't be opened"),
        (["serve", "--contact-resistance", "nan"], "0..0.1"),
        (["serve", "--vlm-timeout", "0"], "0.1..600"),
        (["stream", "nowhere"], "neither a folder"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(arguments, complaint):
    done = command(*arguments)
    assert done.returncode == 2
    assert complaint in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_every_command_has_help():
    for arguments in (["serve"], ["stream"], ["demo"], ["measure"], ["measure", "stop"]):
        done = command(*arguments, "--help")
        assert done.returncode == 0
        assert "usage: hapticvlm" in done.stdout


def test_a_taken_port_is_said_in_one_line():
    from hapticvlm.client.local_service import running

    with running() as service:
        port = service.url.rstrip("/").rsplit(":", 1)[1]
        done = command("serve", "--port", port)
    assert done.returncode == 2
    assert f"port {port} is in use" in done.stderr
    assert "--port 0" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_misspelt_command_names_the_nearest(capsys):
    with pytest.raises(SystemExit):
        main(["galery", "list"])
    assert "did you mean gallery?" in capsys.readouterr().err


def test_a_misspelt_option_names_the_nearest_and_its_own_command(capsys):
    with pytest.raises(SystemExit) as end:
        main(["serve", "--prot", "1"])
    assert end.value.code == 2
    said = capsys.readouterr().err
    assert said == "hapticvlm serve: --prot: no such option; did you mean --port?\n"


def test_a_bare_call_prints_the_overview(capsys):
    assert main([]) == 0
    assert "serve" in capsys.readouterr().out


def test_what_the_user_can_mend_is_one_line_that_names_the_command(tmp_path, capsys):
    assert main(["replay", str(tmp_path / "missing")]) == 2
    said = capsys.readouterr().err
    assert said.startswith("hapticvlm replay: ")
    assert said.count("\n") == 1


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
