"""Runs the tests' programs in node."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

from pace import PACE
from toolchains import require


def printed(*command: str | Path, cases: Any = None) -> Any:
    """Return the JSON that a program printed of its arguments, and of cases on its input."""
    require("node")
    ran = subprocess.run(
        ["node", *command],
        input=json.dumps(cases),
        capture_output=True,
        text=True,
        timeout=120 * PACE,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)
