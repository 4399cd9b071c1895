"""`hapticvlm study new`: writes the file of a new study."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

_NEW = """
Write DIR/study.toml, the commented file of a new study: consent, instructions, questions, ratings,
languages (English and German), patterns and participants. It runs as it is.
"""


def add(parts: Commands) -> None:
    """Declare `study new`."""
    new = parts.add_parser(
        "new",
        help="write the file of a new study",
        description=_NEW,
        examples=("hapticvlm study new pilot --pilot", "hapticvlm study run pilot --hear"),
    )
    new.set_defaults(run=_new)
    new.add_argument("folder", type=Path, metavar="DIR", help="folder of the new study")
    new.add_argument(
        "--pilot",
        action="store_true",
        help="a short one to try it out: every pattern once in training and once as a trial",
    )


def _new(options: argparse.Namespace) -> int:
    from hapticvlm import documents
    from hapticvlm.errors import shell_word, usage_errors
    from hapticvlm_studio.design.form import FILE, TEMPLATE
    from hapticvlm_studio.design.stimuli import StudyError

    path: Path = options.folder / FILE
    if path.exists():
        raise StudyError(f"{path} already exists; edit it, or give another folder")
    with usage_errors():
        options.folder.mkdir(parents=True, exist_ok=True)
        text = TEMPLATE.read_text(encoding="utf-8")
        documents.replace_file(path, _shortened(text) if options.pilot else text)
    print(f"wrote {path}: edit it, then")
    running = f"hapticvlm study run {shell_word(options.folder)}"
    print(f"  {running} --hear    try it without a device")
    print(f"  {running}           run it")
    return 0


def _shortened(text: str) -> str:
    """Return the file of a study (TOML) for one, with each pattern played once for each purpose."""
    return re.sub(
        r"^(participants|repeats|renderings) = \d+ ", r"\1 = 1 ", text, flags=re.MULTILINE
    )
