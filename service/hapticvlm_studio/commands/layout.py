"""`hapticvlm study new`, and how a study is laid out: by its file, or by options."""

from __future__ import annotations

import argparse
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm_studio.design.design import Design, Plan
    from hapticvlm_studio.design.form import Form, StudyFile
    from hapticvlm_studio.design.stimuli import Stimulus
    from hapticvlm_studio.trials.record import Pace

_NEW = """
Write DIR/study.toml, the file of a new study with comments: consent, instructions, questions,
ratings, languages (English and German), patterns and participants. It runs as it is.
"""
_OPTIONS = ("patterns", "participants", "order", "repeats", "renderings", "seed")
_MOST_PEOPLE = 999
_MOST_REPEATS = 100
_MOST_REST_S = 600.0


def add(parts: Commands) -> None:
    """Declare the part."""
    new = parts.add_parser(
        "new",
        help="begin a study: write its file",
        description=_NEW,
        examples=("hapticvlm study new pilot", "hapticvlm study run pilot --hear"),
    )
    new.set_defaults(run=_new)
    new.add_argument("folder", type=Path, metavar="DIR", help="folder of the new study")


def _new(options: argparse.Namespace) -> int:
    from hapticvlm.errors import usage_errors
    from hapticvlm_studio.design.form import FILE, TEMPLATE
    from hapticvlm_studio.design.stimuli import StudyError

    path: Path = options.folder / FILE
    if path.exists():
        raise StudyError(f"{path} is there already")
    with usage_errors():
        options.folder.mkdir(parents=True, exist_ok=True)
        path.write_text(TEMPLATE.read_text(encoding="utf-8"), encoding="utf-8")
    print(f"{path}: edit it as you like, then")
    print(f"  hapticvlm study run {options.folder} --hear    try it without a device")
    print(f"  hapticvlm study run {options.folder}           run it")
    return 0


def layout(options: argparse.Namespace) -> tuple[Design, Pace]:
    """Read the study of this folder, or begin it. Raises StudyError."""
    from hapticvlm_studio.design import form
    from hapticvlm_studio.design.form import StudyFile

    given = form.read(options.folder)
    pace = _pace(options, StudyFile() if given is None else given[1])
    return (_by_options(options) if given is None else _by_file(options, *given)), pace


def _by_file(options: argparse.Namespace, form: Form, file: StudyFile) -> Design:
    from hapticvlm_studio.design import design
    from hapticvlm_studio.design.form import FILE
    from hapticvlm_studio.design.stimuli import StudyError

    path = options.folder / FILE
    asked = [name for name in _OPTIONS if getattr(options, name) is not None]
    if asked:
        raise StudyError(f"{path} lays the study out: say it there, not by --{asked[0]}")
    made = _designed(form, file)
    if not (options.folder / design.HEAD).exists():
        design.write_design(options.folder, made)
        return made
    begun = design.read_design(options.folder)
    if begun != made:
        raise StudyError(
            f"{path} is not what this study was begun with (other: {_difference(begun, made)}); "
            "put it back as it was, or take a new folder"
        )
    return begun


def _difference(begun: Design, made: Design) -> str:
    """Name the parts in which two designs differ."""
    parts = [
        *((name, begun.form, made.form) for name in begun.form.__struct_fields__),
        *((name, begun, made) for name in ("stimuli", "participants", "repeats", "renderings")),
        *((name, begun, made) for name in ("order", "seed")),
    ]
    found = [name for name, first, second in parts if getattr(first, name) != getattr(second, name)]
    return ", ".join(found) or "trials"


def _designed(form: Form, file: StudyFile) -> Design:
    from hapticvlm_studio.design.design import Plan, design
    from hapticvlm_studio.design.patterns import ours

    names = ("repeats", "renderings", "order", "seed")
    plan = {name: value for name in names if (value := getattr(file, name)) is not None}
    stimuli = file.stimuli() or (ours() if file.patterns is None else patterns_named(file.patterns))
    people = file.participants if file.participants is not None else 1
    codes = _numbered(people) if isinstance(people, int) else people
    return design(stimuli, codes, _checked(replace(Plan(form=form), **plan)))


def _by_options(options: argparse.Namespace) -> Design:
    from hapticvlm_studio.design import design
    from hapticvlm_studio.design.patterns import ours
    from hapticvlm_studio.design.stimuli import StudyError

    if (options.folder / design.HEAD).exists():
        found = design.read_design(options.folder)
        if _wanted(options, found.stimuli, found.participants, _plan_of(found)) != found:
            raise StudyError(f"{options.folder} holds a study of another design; take a new folder")
        return found
    if not options.without_file and all(getattr(options, name) is None for name in _OPTIONS):
        raise StudyError(_no_study(options.folder))
    made = _wanted(options, ours(), ("P01",), design.Plan())
    design.write_design(options.folder, made)
    return made


def _no_study(folder: Path) -> str:
    """Say that a folder holds no study, and which one beside it was probably meant."""
    from hapticvlm_studio.design.design import HEAD
    from hapticvlm_studio.design.form import FILE

    others = [path for path in folder.absolute().parent.glob("*/") if path.name != folder.name]
    studies = [each.name for each in others if any((each / name).exists() for name in (FILE, HEAD))]
    near = get_close_matches(folder.name, studies, n=1)
    meant = f"did you mean {folder.parent / near[0]}? Else " if near else ""
    return (
        f"{folder}: no {FILE} here; {meant}`hapticvlm study new {folder}` writes one, "
        "and --without-file does without"
    )


def _plan_of(design: Design) -> Plan:
    from hapticvlm_studio.design.design import Plan

    return Plan(design.repeats, design.renderings, design.seed, design.order, design.form)


def _wanted(
    options: argparse.Namespace,
    stimuli: tuple[Stimulus, ...],
    participants: tuple[str, ...],
    plan: Plan,
) -> Design:
    """Lay out what the options ask for, the rest as given. Raises StudyError."""
    from hapticvlm_studio.design.design import design

    if options.patterns not in (None, "default"):
        stimuli = patterns_named(options.patterns)
    if options.participants is not None:
        participants = _codes(options.participants)
    asked = {name: getattr(options, name) for name in ("repeats", "renderings", "seed", "order")}
    given = {name: value for name, value in asked.items() if value is not None}
    return design(stimuli, participants, _checked(replace(plan, **given)))


def _checked(plan: Plan) -> Plan:
    from hapticvlm_studio.design.stimuli import StudyError

    if not 1 <= plan.repeats <= _MOST_REPEATS or not 0 <= plan.renderings <= _MOST_REPEATS:
        raise StudyError("repeats and renderings: at most 100, repeats at least 1")
    return plan


def patterns_named(name: str) -> tuple[Stimulus, ...]:
    """Return a set of this program's by its name, or read a file. Raises StudyError."""
    from hapticvlm_studio.design import patterns, stimuli

    named = {"ours": patterns.ours, "twenty": patterns.twenty, "paper-like": patterns.paper_like}
    return named[name]() if name in named else stimuli.read(Path(name))


def _codes(text: str) -> tuple[str, ...]:
    if not text.isdigit():
        return tuple(code.strip() for code in text.split(","))
    return _numbered(int(text))


def _numbered(count: int) -> tuple[str, ...]:
    from hapticvlm_studio.design.stimuli import StudyError

    if not 1 <= count <= _MOST_PEOPLE:
        raise StudyError(f"participants: 1 to {_MOST_PEOPLE}")
    return tuple(f"P{number:02d}" for number in range(1, count + 1))


def _pace(options: argparse.Namespace, file: StudyFile) -> Pace:
    from hapticvlm_studio.design.stimuli import StudyError
    from hapticvlm_studio.trials.record import Pace

    rest_s = options.rest if options.rest is not None else file.rest_s
    masks = (options.masking_noise or bool(file.masking_noise)) and not options.hear
    pace = Pace(masking_noise=masks, hear=options.hear)
    if rest_s is None:
        return pace
    if not 0.0 <= rest_s <= _MOST_REST_S:
        raise StudyError(f"rest_s {rest_s:g}: not within 0..{_MOST_REST_S:g}")
    return replace(pace, rest_s=rest_s)
