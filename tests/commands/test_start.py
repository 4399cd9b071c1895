"""The service loads little before it is ready, but all that a touch would wait for."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from hapticvlm import materials
from hapticvlm.vision.galleries.user_materials import UserMaterial, write_material

# Each takes half a second of a processor or more, in every process that loads it.
SLOW = ("scipy.signal", "scipy.stats", "scipy.optimize", "matplotlib")
PUT_TOGETHER = """
import sys
from pathlib import Path
from hapticvlm.commands import run_service
from hapticvlm.server import assemble
from hapticvlm.server.settings import ServeOptions
gallery = Path(sys.argv[1]) if sys.argv[1:] else None
assemble.build_service(ServeOptions(gallery=gallery))
"""
STRUCK = """
import sys
from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.impacts import impact
from hapticvlm.rendering.vibration.vibration import IMPACTS, Motion
from hapticvlm.rendering.vibration.voices import Voices
Voices(table=MATERIALS)
for material in MATERIALS.values():
    for interaction in IMPACTS:
        impact(material.vibration, interaction, Motion(1.0, 4.0), 1)
"""


def loaded(code: str, *arguments: str) -> set[str]:
    """Run code in a Python of its own; return which of SLOW it has loaded."""
    code += f"\nprint(*({set(SLOW)!r} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True
    )
    return set(done.stdout.split())


def test_the_gateway_of_built_in_materials_loads_nothing_slow() -> None:
    assert loaded(PUT_TOGETHER) == set()


def test_what_filters_a_users_material_is_there_before_it_is_touched(tmp_path: Path) -> None:
    write_material(UserMaterial(materials.derive("obsidian", "glass"), "glass"), tmp_path)

    assert "scipy.signal" in loaded(PUT_TOGETHER, str(tmp_path))


def test_no_blow_on_a_built_in_material_loads_the_filter() -> None:
    assert loaded(STRUCK) == set()
