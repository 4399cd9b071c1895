"""What commands print where the pipe has a code page that lacks the letters of a name."""

import io
import shutil
import sys
from pathlib import Path

import pytest

from hapticvlm import pages
from hapticvlm.commands.main import main

STOOL = Path(__file__).parents[2] / "examples" / "webxr" / "stool.glb"
KETTLE = Path(str(pages.__path__[0])) / "try.kettle.jpg"
LINES = (
    "scan {}",
    "recognise {}",
    "bake {}/stool.glb --out {}/bake",
    "study new {}/study",
    "feel glass --save {}/felt.html",
    "doctor --config {}/none.toml",
)


@pytest.mark.parametrize("code_page", ["cp1252", "ascii"])
def test_a_letter_that_the_pipe_lacks_ends_no_command(
    code_page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "文 \udc80"
    folder.mkdir()
    shutil.copy(STOOL, folder / "stool.glb")
    shutil.copy(KETTLE, folder / "kettle.jpg")
    for line in LINES:
        data = io.BytesIO()
        pipe = io.TextIOWrapper(data, encoding=code_page)
        for stream in ("stdout", "stderr"):
            monkeypatch.setattr(sys, stream, pipe)
        main([word.format(folder) for word in line.split()])
        pipe.flush()
        assert b"\\u6587" in data.getvalue() or pipe.encoding == "utf-8", line
