"""Puts the browser scene of examples/webxr into the wheel, with the libraries that draw it.

three.js and MessagePack for JavaScript are fetched by npm and are no part of the repository, so a
wheel draws the scene only if they were fetched before it was built:

    npm ci --prefix examples/webxr && python -m build

Without them the wheel is built all the same, with the player that `hapticvlm demo --static` writes;
`hapticvlm demo --browser` says what it lacks.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PLACE = Path("hapticvlm") / "scene"  # in the wheel
MODULES = "webxr/node_modules"
# Patterns below examples/. What is not named there stays out: A-Frame and the emulated headset are
# large. `hapticvlm demo --static` writes the same files.
SCENE = Path("service") / "hapticvlm" / "demo" / "scene_files.json"


class SceneHook(BuildHookInterface[Any]):
    """Adds the files of the scene; an editable install reads them where they lie."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Name the scene's files to the builder of the wheel."""
        examples = Path(self.root) / "examples"
        if version == "editable":
            return
        if not (examples / MODULES / "three").is_dir():
            self.app.display_warning("no browser scene in it: npm ci --prefix examples/webxr first")
        for pattern in json.loads((Path(self.root) / SCENE).read_text(encoding="utf-8")):
            for file in examples.glob(pattern):
                place = PLACE / file.relative_to(examples)
                build_data["force_include"][str(file)] = place.as_posix()
