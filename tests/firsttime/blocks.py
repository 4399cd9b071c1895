"""The commands that the documents show, in the order a reader meets them, and those not run here.

A command is a line of a fenced block without a language or of a shell; comments after two blanks
and a `#` are for people. Whatever stands in no row of NOT_RUN is run as it is written.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCUMENTS = (
    "README.md",
    *sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").glob("*.md")),
    "examples/captures/README.md",
    "examples/webxr/README.md",
    "firmware/README.md",
    "unity_client/README.md",
)
SHELLS = ("", "sh", "bash", "console")

# What is not run, and why. The first row that fits counts.
NOT_RUN = (
    (r"apt-get ", "installs on the machine"),
    (r"adb ", "needs a headset on a cable"),
    (r"avrdude |make -C firmware/avr upload|hapticvlm plate flash", "needs a board"),
    (r"docker ", "needs a container engine"),
    (r"git |uv |pipx |pip |py |make (?:demo|test)", "installs; tests/service/test_install.py does"),
    (r'echo "\$\(git remote', "needs a clone with an origin; tests/unity_client/test_upm.py"),
    (r"npm ", "downloads; tests/browser/test_webxr.py uses what it brings"),
    (r"hapticvlm demo --browser", "needs three.js; tests/browser/test_webxr.py runs it"),
    (r"hapticvlm demo --static", "needs three.js; tests/demo/test_static_site.py runs it"),
    (r"export ", "sets a variable for the command below it"),
    (
        r"hapticvlm recogniser-app|serve (?:run|deploy)",
        "runs until it is stopped; tests/recogniser_app runs it",
    ),
    (r"hapticvlm .*--recogniser-url", "needs a shared recogniser; tests/recogniser_app"),
    (r"hapticvlm stream", "needs a service that runs; tests/client/test_stream.py"),
    (r"hapticvlm stop", "needs a service that runs; tests/commands/test_stop_command.py"),
    (r"hapticvlm .*(?:--vlm|--encoder|--vlm-url)\b", "needs a model from a hub or an endpoint"),
    (r"hapticvlm .*--(?:peltier|speaker) (?!simulated)", "needs a device"),
    (r"hapticvlm plate ", "needs a board; tests/commands use a simulated one"),
    (r"python examples/captures/make|python tests/browser", "drives a browser for minutes"),
    (r"make -C firmware|python tests/firmware", "needs cross compilers; tests/firmware runs it"),
    (r"hapticvlm (?:gallery build|serve) .*(?:scene\.npz|pictures --base)", "needs those pictures"),
    (r"hapticvlm serve .*--tls-cert", "has a test with certificates: tests/server/test_wss.py"),
    (r"hapticvlm bake SESSION", "needs a record; tests/studio/test_bake_command.py makes one"),
    (r"hapticvlm study run", "waits for a participant; tests/browser/test_study_page.py"),
    (r"hapticvlm (?:chart|stability|measure)", "takes minutes; tests/lab"),
)


@dataclass(frozen=True, slots=True)
class Command:
    """One command as it is written; `setting` holds the variables its block set before it."""

    document: str
    line: int
    text: str
    setting: str = ""

    @property
    def reason(self) -> str | None:
        """Why it is not run here, or None."""
        bare = re.sub(r"^(?:[A-Za-z_]+=\S*\s+)+", "", self.text)
        return next((why for what, why in NOT_RUN if re.match(what, bare)), None)

    @property
    def place(self) -> str:
        """Where it stands."""
        return f"{self.document}:{self.line}"


def commands(document: str, text: str) -> Iterator[Command]:
    """Yield the commands of one document."""
    language: str | None = None
    setting = whole = ""
    for number, row in enumerate(text.splitlines(), 1):
        if row.lstrip().startswith("```"):
            language = row.strip("` ") if language is None else None
            setting = whole = ""
        elif language in SHELLS:
            whole += re.sub(r"(?:^|\s{2,})# .*|\s{2,}#.*", "", row.removeprefix("$ ")).strip()
            if whole.endswith("\\"):
                whole = whole[:-1]
            elif re.fullmatch(r"[A-Z_]+=\S+", whole):
                setting, whole = f"{setting}{whole}\n", ""
            elif whole:
                yield Command(document, number, whole, setting)
                whole = ""


def shown() -> list[Command]:
    """Return the commands of every document."""
    return [
        command
        for document in DOCUMENTS
        for command in commands(document, (ROOT / document).read_text(encoding="utf-8"))
        if not document.startswith("docs/MEASURED")
    ]
