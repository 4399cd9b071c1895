"""Plant defects by rule, one at a time: `python tests/defects.py [ROOM ...] [--share S]`.

Each number becomes ten times as much, each member of `and`, `or`, `+`, `-` and of a tuple, set or
list of three is left out, each guard is never true, each truth is turned, each call that is a
statement is left out. Then the tests of the room run. A defect that they do not notice is a value
that no test states, or code that nobody needs; `defects.txt` lists those that are left, each after
one word: `equal` (no difference by meaning), `speed` (only slower) or `open` (a test is missing).
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
LISTED = Path(__file__).with_name("defects.txt")
SERVICE, PLAYER_CS = "service/hapticvlm", "unity_client/Runtime/Baked"
ADDON = "examples/godot/addons/hapticvlm"
HOST_TESTS = "make -C firmware/hosttests SANITIZE= FLAGS=-std=gnu++14\\ -O0\\ -I../core\\ -I. test"
ROOMS = {  # of each, its files and its tests
    "edge": (
        f"{SERVICE}/server/edge/*.py {SERVICE}/server/access.py",
        "tests/server/test_[ebrp][dueih][dgqan]*.py tests/server/test_[hs][tc][teh]*.py",
    ),
    "web": (
        f"{SERVICE}/server/web/*.py",
        "tests/server/test_http.py tests/server/test_*_file*.py tests/server/test_[lw][as][ns]*.py",
    ),
    "queues": (
        f"{SERVICE}/server/recognition_queue.py {SERVICE}/server/supervision.py",
        "tests/server/test_gateway.py tests/server/test_supervision.py tests/server/test_server.py",
    ),
    "frames": (
        f"{SERVICE}/vision/frame_*.py",
        "tests/vision/test_frame_*.py tests/vision/test_remote_client.py tests/vision/test_te*.py",
    ),
    "speaker": (
        f"{SERVICE}/devices/speaker/engine.py",
        "tests/devices/test_engine.py tests/devices/test_audio.py",
    ),
    "leases": (
        f"{SERVICE}/server/ownership.py {SERVICE}/server/handshake.py",
        "tests/server/test_gateway.py tests/server/test_ow*.py tests/server/test_ha*.py",
    ),
    "stop": (f"{SERVICE}/commands/stop.py", "tests/commands/test_stop_command.py"),
    "session": (f"{SERVICE}/session/*.py", "tests/session/test_*.py"),
    "plate": (
        f"{SERVICE}/devices/plate/*.py",
        "tests/devices/test_p*.py tests/devices/test_board_clock.py",
    ),
    "core": ("firmware/core/*.cpp firmware/core/limits.h", HOST_TESTS),
    "player_js": ("examples/webxr/client/player.js", "tests/contract/test_feel_player.py"),
    "player_cs": (f"{PLAYER_CS}/FeelPlayer*.cs", "tests/unity_client/test_baked.py"),
    "player_gd": (f"{ADDON}/feel_player.gd", "tests/engines/test_godot_feel.py"),
}
NIGHTLY = ("player_gd",)  # their tests carry that marker
LIMIT_S = 60.0  # and five times what the tests take: a defect that hangs is noticed
STRING = r'"""[\s\S]*?"""|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|`[^`]*`'
HASH_COMMENT = r"#[^\n]*|@dataclass[^\n]*|if TYPE_CHECKING"
SLASH_COMMENT = r"^#[^\n]*|//[^\n]*|/\*[\s\S]*?\*/"
ZERO = r"0(?:\.0*)?[fuUL]*(?![\w.])"
NUMBER = rf"(?<![\w.])(?!{ZERO})(?:0x[\da-fA-F]+|\d[\d_]*(?:\.\d+)?(?:e[+-]?\d+)?)[fuUL]*\b"
KEEP = "(?<!frozen=)(?<!slots=)(?<!gc=)(?<!strict=)"  # they make it fast or strict
ITEM = r"[^()\[\]{};,]*"
LIST = rf"(?<![\w)\]])(?<!import )(?<!examples=)[(\[{{]({ITEM}(?:,{ITEM}){{2,}})[)\]}}](?! =>)"
CALL = r"^([ \t]+)(?!return|assert|raise|\w*log\w*\.)(?:await )?[\w.>-]+\([^\n]*\);?$"


@dataclass(frozen=True)
class Defect:
    """Another text for one part of a file."""

    file: str
    begin: int
    end: int
    planted: str
    line: int
    name: str  # with what was there and what is, without the line's number: it outlives a change


def defects(file: str) -> Iterator[Defect]:
    """Yield every defect that the rules make of a file, named by its path in the repository."""
    text = (ROOT / file).read_text("utf-8")
    words = file.endswith((".py", ".gd"))
    blank = f"{STRING}|{HASH_COMMENT if words else SLASH_COMMENT}"
    code = re.sub(blank, lambda each: "_" * len(each[0]), text, flags=re.MULTILINE)
    same: Counter[str] = Counter()
    for begin, end, planted in sorted(
        {*replaced(code, words), *shortened(code), *passed(code, words)}
    ):
        planted = re.sub(r"@(\d+):(\d+)@", lambda at: text[int(at[1]) : int(at[2])], planted)
        left, right = text.rfind("\n", 0, begin) + 1, text.find("\n", end)
        was, now = (
            " ".join((text[left:begin] + part + text[end:right]).split())
            for part in (text[begin:end], planted)
        )
        name = f"{file}: {was} -> {now}"
        same[name] += 1
        name += f" ({same[name]})" if same[name] > 1 else ""
        yield Defect(file, begin, end, planted, text.count("\n", 0, begin) + 1, name)


def replaced(code: str, words: bool) -> Iterator[tuple[int, int, str]]:
    """Yield begin, end and text of each change of a number, an operator, a flag or a call."""
    false, both, either = ("False", "and", "or") if words else ("false", "&&", "||")
    rules = {
        NUMBER: (r"(\g<0> * 10)",),
        r"(?<=\s)(?:and|or|&&|\|\|)(?=\s)": (
            f"{either} {false} {both}",
            f"{both} {false} {either}",
        ),
        r"(?<=[\w)\]] )[+-](?= )": (r"\g<0> 0 *", r"* 0 \g<0>"),
        rf"{KEEP}\bTrue\b": ("False",),
        r"\btrue\b": ("false",),
        rf"{KEEP}\bFalse\b": ("True",),
        r"\bfalse\b": ("true",),
        CALL: (r"\1pass" if words else r"\1;",),
    }
    for pattern, planted in rules.items():
        for at in re.finditer(pattern, code, re.MULTILINE):
            yield from ((*at.span(), at.expand(each)) for each in planted)


def shortened(code: str) -> Iterator[tuple[int, int, str]]:
    """Yield the place of each member of a list of three or more."""
    for at in re.finditer(LIST, code):
        begin = at.start(1)
        for member in at[1].split(","):
            if member.strip():
                yield begin, min(begin + len(member) + 1, at.end(1)), ""
            begin += len(member) + 1


def passed(code: str, words: bool) -> Iterator[tuple[int, int, str]]:
    """Yield the place of each guard, with the text that is never true; `@B:E@` is what it was."""
    guard = r"^[ \t]*(?:el)?if (.+):$" if words else r"\bif (\()"
    for at in re.finditer(guard, code, re.MULTILINE):
        begin, end = at.span(1)
        while code.count("(", begin, end) > code.count(")", begin, end):
            end += 1
        false = "False and" if words else "(false &&"
        yield begin, end, f"{false} (@{begin}:{end}@){'' if words else ')'}"


def is_noticed(room: str, file: str, scratch: Path, limit_s: float) -> bool:
    """Run the tests of a room in a copy of the repository, those that name the file first."""
    command = shlex.split(ROOMS[room][1])
    if command[0] != "make":
        tests = [each for pattern in command for each in sorted(scratch.glob(pattern))]
        tests.sort(key=lambda each: Path(file).stem not in each.read_text("utf-8"))
        markers = "nightly" if room in NIGHTLY else "not nightly and not realtime"
        options = ("-q", "-x", "-n", "0", "-p", "no:cacheprovider", "-m", markers)
        command = [sys.executable, "-m", "pytest", *options, *map(str, tests)]
    env = {**os.environ, "PYTHONPATH": f"{scratch / 'service'}", "CI": "1"}
    log = scratch / "defect.log"
    with log.open("w") as out:
        ran = subprocess.Popen(
            command, cwd=scratch, env=env, stdout=out, stderr=out, start_new_session=True
        )
        try:
            return ran.wait(limit_s) != 0
        except subprocess.TimeoutExpired:
            return True
        finally:
            if ran.poll() is None:
                os.killpg(ran.pid, signal.SIGKILL)
                ran.wait()


def unseen(room: str, chosen: list[Defect], scratch: Path) -> Iterator[Defect]:
    """Yield the defects that the tests of their room do not notice, each asked twice."""
    began = time.monotonic()
    assert not is_noticed(room, "", scratch, 900.0), (scratch / "defect.log").read_text()[-4000:]
    limit_s = LIMIT_S + 5.0 * (time.monotonic() - began)
    for each in chosen:
        file = scratch / each.file
        sound = file.read_text("utf-8")
        file.write_text(sound[: each.begin] + each.planted + sound[each.end :], "utf-8")
        if not any(is_noticed(room, each.file, scratch, limit_s) for _ in range(2)):
            yield each
        file.write_text(sound, "utf-8")


def planned(room: str, share: float = 1.0) -> list[Defect]:
    """Return the defects of a room, or a share of them: which, their names alone decide."""
    files = sorted({file for pattern in ROOMS[room][0].split() for file in ROOT.glob(pattern)})
    every = [each for file in files for each in defects(file.relative_to(ROOT).as_posix())]
    return [each for each in every if zlib.crc32(each.name.encode()) < share * 2**32]


def copied(scratch: Path) -> Path:
    """Copy what the repository holds, and link what was installed beside it."""
    command = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
    names = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, names.split("\0")):
        if (ROOT / name).exists():
            (scratch / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, scratch / name)
    for installed in ROOT.glob("*/*/node_modules"):
        (scratch / installed.relative_to(ROOT)).symlink_to(installed)
    return scratch


def listed() -> dict[str, str]:
    """Return what nobody needs to notice, and what nobody does yet: the reason of each defect."""
    lines = LISTED.read_text("utf-8").splitlines()
    return {name: reason for reason, _, name in (line.partition(" ") for line in lines)}


def main() -> int:
    """Plant those of the rooms named, or all; return how many unlisted ones nobody noticed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("room", nargs="*", choices=[*ROOMS, []])
    parser.add_argument("--share", type=float, default=1.0, help="of each room, only such a part")
    asked = parser.parse_args()
    survivors, known = 0, listed()
    with tempfile.TemporaryDirectory() as folder:
        scratch = copied(Path(folder))
        for room in asked.room or ROOMS:
            chosen = [each for each in planned(room, asked.share) if each.name not in known]
            print(f"{room}: {len(chosen)} defects", flush=True)
            for each in unseen(room, chosen, scratch):
                survivors += 1
                print(f"{each.line} open {each.name}", flush=True)
    print(f"{survivors} unseen that {LISTED.name} does not list")
    return survivors


if __name__ == "__main__":
    sys.exit(main())
