"""Checks docs/physics.md: cited sections exist, and its figures equal those of the code."""

import re
import tomllib
from pathlib import Path

import pytest

from hapticvlm.materials import MATERIALS
from hapticvlm.messages import LEASE_MS
from hapticvlm.perception import threshold_db
from hapticvlm.rendering.heat import limits as plate_limits

ROOT = Path(__file__).parents[2]
FAULTS = ROOT / "service/hapticvlm/devices/faults.toml"
TEXT = (ROOT / "docs/physics.md").read_text(encoding="utf-8")
HEADINGS = frozenset(re.findall(r"^#{2,3} ([0-9](?:\.[0-9])?)[. ]", TEXT, re.MULTILINE))
KINDS = frozenset({".py", ".cpp", ".h", ".toml", ".md"})
CITED = re.compile(r"physics\.md (\d(?:\.\d)?)")
NOT_HERE = re.compile(r"physics reference|\bDESIGN \d|design section", re.IGNORECASE)


def sources():
    """Path and text of every file that may cite a section."""
    for folder in ("service", "firmware", "tests"):
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in KINDS and path != Path(__file__) and "build" not in path.parts:
                yield path.relative_to(ROOT), path.read_text(encoding="utf-8")


def rows(section):
    """Cells of the first table of a section, without its head and rule."""
    part = re.split(rf"^### {re.escape(section)} .*$", TEXT, flags=re.MULTILINE)[1]
    lines = [line for line in part.split("\n#")[0].splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_every_section_that_code_cites_exists():
    cited = [(path, number) for path, text in sources() for number in CITED.findall(text)]

    assert len(cited) > 30
    assert [(str(path), number) for path, number in cited if number not in HEADINGS] == []


def test_code_cites_no_document_that_is_not_in_the_repository():
    assert [str(path) for path, text in sources() if NOT_HERE.search(text)] == []


def test_its_materials_are_those_of_the_table():
    known = {cells[0]: tuple(map(float, cells[1:4])) for cells in rows("1.2")[2:]}

    for name, material in MATERIALS.items():
        bulk = material.thermal
        assert known[name] == (bulk.conductivity, bulk.density, bulk.heat_capacity), name


def test_its_threshold_is_the_one_that_levels_are_made_by():
    hertz, decibels = rows("4.1")[0], rows("4.1")[2]

    for frequency, level in zip(hertz[1:], decibels[1:], strict=True):
        assert threshold_db(float(frequency)) == pytest.approx(float(level))


def test_its_limits_are_those_of_the_plate():
    limits = {cells[0]: cells[1] for cells in rows("3.2")[2:]}

    low, high = plate_limits.SETPOINT_MIN_C, plate_limits.SETPOINT_MAX_C
    assert limits["setpoint"] == f"{low:g} to {high:g} degC"
    cool, heat = plate_limits.COOL_SLEW_C_PER_S, plate_limits.HEAT_SLEW_C_PER_S
    assert limits["slew"] == f"{cool:g} degC/s of cooling, {heat:g} degC/s of heating"
    trips = plate_limits.PLATE_TRIP_HIGH_C, plate_limits.PLATE_TRIP_LOW_C
    assert limits["trips"] == "{:g} and {:g} degC".format(*trips)
    assert limits["heat in a session"].startswith(f"{plate_limits.HEAT_LIMIT_S:g} s,")
    assert limits["sink, derating and trip"].endswith(f"; {plate_limits.SINK_TRIP_C:g} degC")
    assert f"Limit of a session: {plate_limits.DOSE_LIMIT_CEM43:g} CEM43." in TEXT


def test_the_limits_of_the_page_on_safety_are_those_of_the_code():
    text = (ROOT / "docs/safety.md").read_text(encoding="utf-8")
    limits = plate_limits
    latched = tomllib.loads(FAULTS.read_text(encoding="utf-8"))["firmware"]
    for shown in (
        f"{limits.SETPOINT_MIN_C:g} to {limits.SETPOINT_MAX_C:g} degC; cools by at most "
        f"{limits.COOL_SLEW_C_PER_S:g} and heats by at most {limits.HEAT_SLEW_C_PER_S:g} degC/s",
        f"{limits.PLATE_TRIP_HIGH_C:g} and {limits.PLATE_TRIP_LOW_C:g} degC; dose of "
        f"{limits.DOSE_LIMIT_CEM43:g} CEM43; {limits.HEAT_LIMIT_S:g} s of heat",
        f"{LEASE_MS} ms after the last touch",
        f"{len(latched)} latched faults",
    ):
        assert shown in text
