"""The service loads little before it is ready, but all that a touch would wait for."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import hapticvlm

# Each takes half a second of a processor or more, in every process that loads it.
SLOW = ("scipy", "statsmodels", "matplotlib")
HEAVY = (*SLOW, "torch", "transformers", "numpy", "websockets", "msgspec")
HELP = """
import contextlib
from hapticvlm.commands.main import main
with contextlib.suppress(SystemExit):
    main(["--help"])
"""
PUT_TOGETHER = """
from hapticvlm.commands import run_service
from hapticvlm.server import assemble
from hapticvlm.server.settings import ServeOptions
assemble.build_service(ServeOptions())
"""
STRUCK = """
from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.impacts import impact
from hapticvlm.rendering.vibration.vibration import IMPACTS, Motion
from hapticvlm.rendering.vibration.voices import Voices
Voices(table=MATERIALS)
for material in MATERIALS.values():
    for interaction in IMPACTS:
        impact(material.vibration, interaction, Motion(1.0, 4.0), 1)
"""


def loaded(code: str, named: tuple[str, ...] = SLOW) -> set[str]:
    """Run code in a Python of its own; return which of these modules it has loaded."""
    code += f"\nimport sys\nprint('', *({set(named)!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


def test_importing_the_package_or_asking_for_help_loads_nothing_heavy() -> None:
    assert loaded("import hapticvlm", HEAVY) == loaded(HELP, HEAVY) == set()


def test_the_gateway_of_built_in_materials_loads_nothing_slow() -> None:
    assert loaded(PUT_TOGETHER) == set()


def test_no_module_of_the_service_needs_what_the_studio_brings() -> None:
    needs = re.compile(rf"^ *(?:from|import) ({'|'.join(SLOW)})\b", re.MULTILINE)
    modules = list(Path(hapticvlm.__file__).parent.rglob("*.py"))
    assert len(modules) > 200
    assert [module for module in modules if needs.search(module.read_text("utf-8"))] == []


def test_no_blow_on_a_built_in_material_loads_anything_slow() -> None:
    assert loaded(STRUCK) == set()
