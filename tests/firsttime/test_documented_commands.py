"""What the documents tell a reader to type: it parses, and it is run or listed with a reason."""

import argparse
import ast
import re
import shlex
import sys
from pathlib import Path

import pytest
from each_case import each

sys.path.insert(0, str(Path(__file__).parent))
import blocks
from in_process import hapticvlm

from hapticvlm.commands.main import command_line
from hapticvlm.demo.run import _next_steps

PARSER = command_line()
SHOWN = blocks.shown()
INLINE = re.compile(r"`(hapticvlm [^`]+)`")
INSTALLS = r"pip|uv|pipx|docker|git|py |eval |npm "
PLACEHOLDER = {"|", "...", "[all|speaker|peltier]"}
MEANT = {
    "COMMAND": "serve",
    "SHELL": "bash",
    "MATERIAL": "metal",
    "FAULT": "plate_open",
    "FILE": "0.0004",
    "R": "1",
    "S": "1",
    "A": "1",
}

PRINTING = (
    ("study", "new", "my result"),
    ("calibrate", "plate", "--simulate", "5e-4", "--out", "my result"),
    ("calibrate", "speaker", "--simulate", "--by-hand", "--out", "my result"),
    ("gallery", "add", "oak", "pictures/0001.jpg", "--like", "wood", "--out", "my result"),
)


def inline():
    """Every call of the program that stands in a sentence, with its document."""
    for document in (*blocks.DOCUMENTS, "CONTRIBUTING.md"):
        text = " ".join((blocks.ROOT / document).read_text(encoding="utf-8").split())
        for found in INLINE.findall(text):
            yield document, found


def arguments(text):
    """The words after the program's name, as far as one command goes."""
    words = shlex.split(re.split(r"\s(?:\||;|&&|>)\s", text)[0])
    words = words[words.index("hapticvlm") + 1 :]
    return [MEANT.get(word, word) for word in words if word not in PLACEHOLDER]


@each(command=SHOWN)
def test_every_command_of_a_block_is_one_the_program_knows(command):
    if "hapticvlm " in command.text and not re.match(INSTALLS, command.text):
        PARSER.parse_args(arguments(command.text))


def test_every_command_within_a_sentence_is_one_the_program_knows(capsys):
    unknown = []
    for document, text in inline():
        words = arguments(text)
        bare = len([word for word in words if not word.startswith("-")]) <= 2
        try:
            PARSER.parse_args([*words, "--help"] if bare else words)
        except SystemExit as end:
            if end.code:
                unknown.append((document, text, capsys.readouterr().err[-200:]))
    assert not unknown


def test_every_command_that_the_program_itself_prints_is_one_it_knows(tmp_path):
    session = tmp_path / "my session"
    told = [re.sub(r"\\\n\s*", " ", part.epilog or "") for part in (PARSER, *every_parser(PARSER))]
    told.append(_next_steps(session))
    printed = [line for text in told for line in re.findall(r"\bhapticvlm [a-z].*", text)]
    examples = [re.split(r" {2,}|, then|\)\"", line)[0] for line in printed]
    assert f"hapticvlm replay --view {shlex.quote(str(session))}" in examples
    for example in examples:
        PARSER.parse_args(arguments(example))


@pytest.mark.parametrize("words", PRINTING, ids=" ".join)
def test_a_command_that_names_what_was_just_written_can_be_copied(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pictures").symlink_to(blocks.ROOT / "service/hapticvlm/demo/capture/frames")
    said = hapticvlm(*words)
    assert said.code == 0, said.err
    printed = re.findall(r"\bhapticvlm [a-z].*", said.out)
    assert printed
    for line in printed:
        command = arguments(re.split(r" {2,}", line)[0])
        assert "my result" in command
        PARSER.parse_args(command)


def test_every_command_that_a_text_of_the_program_names_is_there_with_its_options():
    named = [(file.name, text) for file, text in texts_of_the_program()]
    assert len(named) > 80
    wrong = []
    for file, text in named:
        words, part = text.split()[1:], PARSER
        while words and (below := choices(part)) and words[0] in below:
            part = below[words.pop(0)]
        known = {flag for action in part._actions for flag in action.option_strings}
        flags = {word.partition("=")[0].rstrip(".,)") for word in words if word.startswith("--")}
        if part is PARSER or not flags <= known:
            wrong.append((file, text))
    assert wrong == []


def texts_of_the_program():
    """Every `hapticvlm COMMAND ...` in backticks or after a colon, of sources, pages and tables."""
    shown = r"(?:`|: |<code>|^# +)(hapticvlm [a-z][^`\"<\n]*)"
    for kind in ("js", "html", "toml"):
        for file in (blocks.ROOT / "service").rglob(f"*.{kind}"):
            for found in re.findall(shown, file.read_text(encoding="utf-8"), re.MULTILINE):
                yield file, found
    for file in (blocks.ROOT / "service").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                text = " ".join(node.value.split())
                for found in re.findall(shown, text):
                    yield file, found


def choices(parser):
    found = [each for each in parser._actions if isinstance(each, argparse._SubParsersAction)]
    return found[0].choices if found else {}


def every_parser(parser):
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for part in action.choices.values():
                yield part
                yield from every_parser(part)


def test_comments_are_for_people_and_settings_hold_for_their_block():
    text = "```sh\nA=1    # an address\necho $A  # says 1\n```\n\n```python\nno()\n```\n"
    text += "```\nx \\\n  y\n```\n"
    found = list(blocks.commands("some.md", text))
    said = [(each.text, each.setting) for each in found]
    assert said == [("echo $A", "A=1\n"), ("x y", "")]


def test_most_of_what_is_not_run_says_which_test_stands_for_it():
    skipped = {command.reason for command in SHOWN if command.reason}
    tests = {name for why in skipped for name in re.findall(r"tests/[\w/]+(?:\.py)?", why)}
    assert tests
    assert not [name for name in tests if not (blocks.ROOT / name).exists()]
