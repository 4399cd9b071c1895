"""What stands on the terminal while an environment is made: something all the time."""

import importlib.machinery
import importlib.util
import os
import sys
import venv
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import run_clone

SCRIPT = Path(__file__).parents[2] / ".ci" / "environment"
SLOW = "import time; print('Collecting numpy', flush=True); time.sleep(1.5); print('done')"


@pytest.fixture
def script():
    loader = importlib.machinery.SourceFileLoader("environment", str(SCRIPT))
    spec = importlib.util.spec_from_loader(loader.name, loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module


def test_what_is_done_is_said_at_once_and_again_at_the_end(script, capsys):
    script.run([sys.executable, "-c", "pass"], "installing")
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("installing, 0 s")
    assert lines[-2].startswith("installing: ")


def test_an_environment_that_an_interruption_left_without_pip_is_made_again(script, tmp_path):
    assert script.is_whole(Path(sys.executable))
    half = tmp_path / "half"
    venv.create(half, with_pip=False)
    assert not script.is_whole(half / ("Scripts" if os.name == "nt" else "bin") / "python")
    assert not script.is_whole(tmp_path / "none")


def test_what_fails_is_shown_whole(script):
    with pytest.raises(SystemExit) as end:
        script.run([sys.executable, "-c", "print('no such package'); raise SystemExit(3)"], "x")
    assert "no such package" in str(end.value)
    assert end.value.code != 0


@pytest.mark.skipif(os.name == "nt", reason="Windows has no pseudo-terminals")
def test_a_terminal_is_never_silent_for_long_and_silence_is_measured(tmp_path):
    caller = f"import runpy, sys; run = runpy.run_path({str(SCRIPT)!r})['run']\n"
    caller += f"run([sys.executable, '-c', {SLOW!r}], 'installing')"
    ticking, text = run_clone.at_a_terminal((sys.executable, "-c", caller), tmp_path)
    assert ticking.status == 0
    assert "Collecting numpy" in text
    silent, _ = run_clone.at_a_terminal((sys.executable, "-c", SLOW), tmp_path)
    assert silent.longest_silence_s >= 1.4
    assert "Collecting numpy" in silent.before_it
    assert ticking.longest_silence_s < silent.longest_silence_s
