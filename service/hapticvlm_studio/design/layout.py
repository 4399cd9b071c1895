"""Lays a study out by its study.toml; what was begun stays as it was begun."""

from __future__ import annotations

from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path

from hapticvlm.errors import shell_word
from hapticvlm_studio.design import form as forms
from hapticvlm_studio.design import patterns
from hapticvlm_studio.design.design import (
    HEAD,
    Design,
    Plan,
    design,
    no_study_folder,
    read_design,
    write_design,
)
from hapticvlm_studio.design.form import FILE, Form, StudyFile
from hapticvlm_studio.design.stimuli import StudyError

_MAX_PEOPLE = 999
_MAX_REPEATS = 100


def layout(folder: Path) -> tuple[Design, StudyFile]:
    """Return the design of the folder's study, and its file; begin the study where it is new.

    Raises StudyError where there is no file, and where it differs from what was begun.
    """
    read = forms.read(folder)
    if read is None:
        raise no_study_folder(folder) if folder.is_file() else StudyError(_no_study(folder))
    form, file = read
    wanted = _designed(form, file)
    if not (folder / HEAD).exists():
        write_design(folder, wanted)
        return wanted, file
    # Trials that were presented under one design must not be continued under another, so the file
    # is compared with what the study was begun with.
    begun = read_design(folder)
    if begun != wanted:
        changed = _difference(begun, wanted)
        raise StudyError(
            f"{folder / FILE} was changed after the study had begun ({changed}); undo the change, "
            "or use a new folder"
        )
    return begun, file


def _no_study(folder: Path) -> str:
    """Return an error that names the study in a neighbouring folder that was probably meant."""
    others = [path for path in folder.absolute().parent.glob("*/") if path.name != folder.name]
    studies = [path.name for path in others if (path / FILE).exists()]
    near = get_close_matches(folder.name, studies, n=1)
    hint = f"did you mean {folder.parent / near[0]}? Otherwise " if near else ""
    return (
        f"{folder} contains no {FILE}; {hint}`hapticvlm study new {shell_word(folder)}` writes one"
    )


def _designed(form: Form, file: StudyFile) -> Design:
    names = ("repeats", "renderings", "order", "seed")
    changes = {name: value for name in names if (value := getattr(file, name)) is not None}
    plan = replace(Plan(form=form), **changes)
    if not 1 <= plan.repeats <= _MAX_REPEATS or not 0 <= plan.renderings <= _MAX_REPEATS:
        raise StudyError(f"repeats must be 1 to {_MAX_REPEATS} and renderings 0 to {_MAX_REPEATS}")
    stimuli = file.stimuli() or patterns.named(file.patterns or "ours")
    people = 1 if file.participants is None else file.participants
    return design(stimuli, _codes(people) if isinstance(people, int) else people, plan)


def _codes(count: int) -> tuple[str, ...]:
    if not 1 <= count <= _MAX_PEOPLE:
        raise StudyError(f"participants: must be 1 to {_MAX_PEOPLE}")
    return tuple(f"P{number:02d}" for number in range(1, count + 1))


def _difference(begun: Design, wanted: Design) -> str:
    """Return the names of the parts in which two designs differ."""
    parts = [
        *((name, begun.form, wanted.form) for name in begun.form.__struct_fields__),
        *((name, begun, wanted) for name in ("stimuli", "participants", "repeats", "renderings")),
        *((name, begun, wanted) for name in ("order", "seed")),
    ]
    names = [name for name, first, second in parts if getattr(first, name) != getattr(second, name)]
    return ", ".join(names) or "trials"
