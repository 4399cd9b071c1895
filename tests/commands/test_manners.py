"""Every command explains itself, and speaks JSON only when asked."""

import argparse
import importlib.util
import json
import re
import shlex
import socket
import sys
from pathlib import Path

import pytest
from in_process import hapticvlm

from hapticvlm.commands import main
from hapticvlm.errors import installing

PARSER = main.command_line()
LABORATORY = {"lab", *main.PARTS["hapticvlm_lab"]}


def commands(parser, name="hapticvlm"):
    """Every command with its parser, the laboratory's included."""
    yield name, parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for word, child in action.choices.items():
                yield from commands(child, f"{name} {word}")


ALL = dict(commands(PARSER))
OPTIONS = {
    f"{name} {'/'.join(action.option_strings) or action.dest}": action
    for name, parser in ALL.items()
    for action in parser._actions
    if not isinstance(action, argparse._SubParsersAction | argparse._HelpAction)
}


def is_explained(help):
    return len(help.split()) >= 2 and not help.startswith(("(", "of "))


def test_every_option_says_what_it_is_in_words():
    assert [name for name, action in OPTIONS.items() if not is_explained(action.help or "")] == []


def test_what_an_option_takes_has_a_short_name():
    taking = {
        name: action
        for name, action in OPTIONS.items()
        if action.option_strings and action.nargs != 0 and not action.choices
    }
    named = ("url", "token", "host")  # the word of the option itself says it
    assert [n for n, action in taking.items() if not (action.metavar or action.dest in named)] == []


def test_json_means_the_same_for_every_command():
    meanings = {a.help for a in OPTIONS.values() if "--json" in a.option_strings}
    assert len(meanings) == 1


def test_every_command_explains_itself_in_whole_sentences():
    words = {name: name.split() for name in ALL}
    commands = [n for n, w in words.items() if len(w) == 2 and w[1] not in LABORATORY]
    assert [n for n in commands if not (ALL[n].description or "").strip().endswith(".")] == []
    assert [n for n in ALL if not ALL[n].format_help().startswith("usage: hapticvlm")] == []


def test_each_example_in_a_help_is_a_call_that_the_command_line_takes():
    for parser in ALL.values():
        for call in re.findall(r"^  (\S+(?: [^\s>\\]+)*)", parser.epilog or "", re.MULTILINE):
            program, *words = shlex.split(call)
            assert (program, bool(PARSER.parse_args(words).program)) == ("hapticvlm", True)


@pytest.mark.parametrize(
    "words",
    [
        ["calibrate", "plate", "--simulate", "5e-4"],
        ["calibrate", "speaker", "--simulate"],
    ],
)
def test_json_comes_alone_and_only_when_asked(words, capsys):
    assert main.main(words) == 0
    assert "{" not in capsys.readouterr().out
    assert main.main([*words, "--json"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert json.loads(line)["calibrate"] == words[1]


MODELS = "torch transformers safetensors"


@pytest.mark.parametrize(
    ("options", "package", "installed"),
    [
        (["--vlm"], "torch", MODELS),
        (["--vlm-url", "http://127.0.0.1:1"], "httpx2", "httpx2"),
        (["--recogniser-url", "http://127.0.0.1:1"], "httpx2", "httpx2"),
    ],
)
def test_a_package_that_will_be_needed_is_asked_for_before_the_service_starts(
    options, package, installed, monkeypatch
):
    there = importlib.util.find_spec

    def without(name: str) -> object:
        return None if name == package else there(name)

    monkeypatch.setattr(importlib.util, "find_spec", without)
    with socket.create_server(("127.0.0.1", 0)) as taken:  # where it would serve otherwise
        done = hapticvlm("serve", "--port", str(taken.getsockname()[1]), *options)
    assert done.code == 2
    (line,) = done.err.splitlines()
    assert line.startswith(f"hapticvlm serve: needs {package}: `")
    assert line.endswith(f"install {installed}`")
    assert not done.out


@pytest.mark.parametrize(
    ("file", "command"),
    [
        ("uv-receipt.toml", "uv pip install --python"),
        ("pipx_metadata.json", "pipx inject hapticvlm torch"),
    ],
)
def test_a_missing_package_is_installed_where_the_program_stands(
    file, command, tmp_path, monkeypatch
):
    (tmp_path / file).touch()
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    assert installing("torch").startswith(command)


def test_in_an_environment_that_is_not_active_the_hint_names_its_python(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    assert sys.executable in installing("torch")
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent))
    assert installing("torch") == "pip install torch"
