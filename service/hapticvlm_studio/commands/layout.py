"""`hapticvlm study new`, and the layout of a study from its file or from options."""

from __future__ import annotations

import argparse
import re
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
Write DIR/study.toml, the commented file of a new study: consent, instructions, questions, ratings,
languages (English and German), patterns and participants. It runs as it is.
"""
_OPTIONS = ("patterns", "participants", "order", "repeats", "renderings", "seed")
_MAX_PEOPLE = 999
_MAX_REPEATS = 100
_MAX_REST_S = 600.0


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
    from hapticvlm.errors import shell_word, usage_errors
    from hapticvlm_studio.design.form import FILE, TEMPLATE
    from hapticvlm_studio.design.stimuli import StudyError

    path: Path = options.folder / FILE
    if path.exists():
        raise StudyError(f"{path} already exists; edit it, or give another folder")
    with usage_errors():
        options.folder.mkdir(parents=True, exist_ok=True)
        text = TEMPLATE.read_text(encoding="utf-8")
        path.write_text(_shortened(text) if options.pilot else text, encoding="utf-8")
    print(f"wrote {path}: edit it, then")
    running = f"hapticvlm study run {shell_word(options.folder)}"
    print(f"  {running} --hear    try it without a device")
    print(f"  {running}           run it")
    return 0


def _shortened(text: str) -> str:
    """Return the file of a study (TOML) with every pattern played once for each purpose."""
    return re.sub(r"^(repeats|renderings) = \d+ ", r"\1 = 1 ", text, flags=re.MULTILINE)


def layout(options: argparse.Namespace) -> tuple[Design, Pace]:
    """Return the design and pace of the folder's study; begin it where it is new.

    Raises StudyError when file, options and a study that was begun do not agree.
    """
    from hapticvlm_studio.design import form
    from hapticvlm_studio.design.form import StudyFile

    file = form.read(options.folder)
    pace = _pace(options, StudyFile() if file is None else file[1])
    return (_by_options(options) if file is None else _by_file(options, *file)), pace


def _by_file(options: argparse.Namespace, form: Form, file: StudyFile) -> Design:
    from hapticvlm_studio.design import design
    from hapticvlm_studio.design.form import FILE
    from hapticvlm_studio.design.stimuli import StudyError

    path = options.folder / FILE
    stated = [name for name in _OPTIONS if getattr(options, name) is not None]
    if stated:
        raise StudyError(f"{path} lays the study out: change it there, not by --{stated[0]}")
    wanted = _designed(form, file)
    if not (options.folder / design.HEAD).exists():
        design.write_design(options.folder, wanted)
        return wanted
    # Trials that were presented under one design must not be continued under another, so the file
    # is compared with what the study was begun with.
    begun = design.read_design(options.folder)
    if begun != wanted:
        changed = _difference(begun, wanted)
        raise StudyError(
            f"{path} was changed after the study had begun ({changed}); undo the change, or use a "
            "new folder"
        )
    return begun


def _difference(begun: Design, wanted: Design) -> str:
    """Return the names of the parts in which two designs differ."""
    parts = [
        *((name, begun.form, wanted.form) for name in begun.form.__struct_fields__),
        *((name, begun, wanted) for name in ("stimuli", "participants", "repeats", "renderings")),
        *((name, begun, wanted) for name in ("order", "seed")),
    ]
    names = [name for name, first, second in parts if getattr(first, name) != getattr(second, name)]
    return ", ".join(names) or "trials"


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
        begun = design.read_design(options.folder)
        # Options that are not given keep their value, so those that are given decide.
        if _wanted(options, begun.stimuli, begun.participants, _plan_of(begun)) != begun:
            raise StudyError(
                f"{options.folder} contains a study of another design; use a new folder"
            )
        return begun
    if not options.without_file and all(getattr(options, name) is None for name in _OPTIONS):
        raise StudyError(_no_study(options.folder))
    wanted = _wanted(options, ours(), ("P01",), design.Plan())
    design.write_design(options.folder, wanted)
    return wanted


def _no_study(folder: Path) -> str:
    """Return an error that names the study in a neighbouring folder that was probably meant."""
    from hapticvlm.errors import shell_word
    from hapticvlm_studio.design.design import HEAD
    from hapticvlm_studio.design.form import FILE

    others = [path for path in folder.absolute().parent.glob("*/") if path.name != folder.name]
    studies = [each.name for each in others if any((each / name).exists() for name in (FILE, HEAD))]
    near = get_close_matches(folder.name, studies, n=1)
    hint = f"did you mean {folder.parent / near[0]}? Otherwise " if near else ""
    return (
        f"{folder} contains no {FILE}; {hint}`hapticvlm study new {shell_word(folder)}` "
        "writes one, and --without-file runs a study without it"
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
    """Return the design that the options ask for, with defaults for the rest. Raises StudyError."""
    from hapticvlm_studio.design.design import design

    if options.patterns not in (None, "default"):
        stimuli = patterns_named(options.patterns)
    if options.participants is not None:
        participants = _codes(options.participants)
    values = {name: getattr(options, name) for name in ("repeats", "renderings", "seed", "order")}
    changes = {name: value for name, value in values.items() if value is not None}
    return design(stimuli, participants, _checked(replace(plan, **changes)))


def _checked(plan: Plan) -> Plan:
    from hapticvlm_studio.design.stimuli import StudyError

    if not 1 <= plan.repeats <= _MAX_REPEATS or not 0 <= plan.renderings <= _MAX_REPEATS:
        raise StudyError(f"repeats must be 1 to {_MAX_REPEATS} and renderings 0 to {_MAX_REPEATS}")
    return plan


def patterns_named(name: str) -> tuple[Stimulus, ...]:
    """Return a shipped set of patterns by its name, or read a file. Raises StudyError."""
    from hapticvlm_studio.design import patterns, stimuli

    named = {"ours": patterns.ours, "twenty": patterns.twenty, "paper-like": patterns.paper_like}
    return named[name]() if name in named else stimuli.read(Path(name))


def _codes(text: str) -> tuple[str, ...]:
    if not text.isdigit():
        return tuple(code.strip() for code in text.split(","))
    return _numbered(int(text))


def _numbered(count: int) -> tuple[str, ...]:
    from hapticvlm_studio.design.stimuli import StudyError

    if not 1 <= count <= _MAX_PEOPLE:
        raise StudyError(f"participants: must be 1 to {_MAX_PEOPLE}")
    return tuple(f"P{number:02d}" for number in range(1, count + 1))


def _pace(options: argparse.Namespace, file: StudyFile) -> Pace:
    from hapticvlm_studio.design.stimuli import StudyError
    from hapticvlm_studio.trials.record import Pace

    rest_s = options.rest if options.rest is not None else file.rest_s
    masks = (options.masking_noise or bool(file.masking_noise)) and not options.hear
    pace = Pace(masking_noise=masks, hear=options.hear)
    if rest_s is None:
        return pace
    if not 0.0 <= rest_s <= _MAX_REST_S:
        raise StudyError(f"rest_s {rest_s:g}: must be 0 to {_MAX_REST_S:g}")
    return replace(pace, rest_s=rest_s)
