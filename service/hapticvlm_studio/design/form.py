"""Reads study.toml: the consent, instructions, questions and ratings of a study, and its plan.

Every text is given once for each language of the study. Everything is checked when the file is
read, so a missing translation is an error before the first participant and not in front of one.
Knows nothing of pages and devices.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct

from hapticvlm import documents
from hapticvlm_studio.design import languages, stimuli
from hapticvlm_studio.design.stimuli import Stimulus, StudyError

FILE = "study.toml"
TEMPLATE = Path(__file__).parent / "new.toml"
MAX_NUMBER = 1e12  # where a question states no bounds
MAX_TEXT = 2000  # characters of a free answer
_MAX_CHOICES = 20
_MAX_STEPS = 11

Texts = dict[str, str]  # by language
Answer = str | float


class Choice(Struct, frozen=True, forbid_unknown_fields=True):
    """One answer to choose from: the data hold `value`, the page shows `text`."""

    value: str
    text: Texts


class Question(Struct, frozen=True, forbid_unknown_fields=True):
    """A question that each participant is asked once, before the training or after the trials.

    `low` and `high` bound a number. Only a `needed` question has to be answered.
    """

    name: str
    text: Texts
    kind: Literal["number", "choice", "text"]
    when: Literal["begin", "end"] = "begin"
    needed: bool = False
    low: float | None = None
    high: float | None = None
    choice: tuple[Choice, ...] = ()


class Rating(Struct, frozen=True, forbid_unknown_fields=True):
    """A scale from 1 to `steps` about the pattern just answered, with a text at either end."""

    name: str
    text: Texts
    low: Texts
    high: Texts
    steps: int = 7


class Form(Struct, frozen=True, forbid_unknown_fields=True):
    """Everything that a study shows and asks; a page begins in the first language.

    `names` translates the names of vibrations and temperatures, by language.
    """

    languages: tuple[str, ...] = (languages.REFERENCE,)
    title: Texts = {}
    consent: Texts = {}
    instructions: Texts = {}
    question: tuple[Question, ...] = ()
    rating: tuple[Rating, ...] = ()
    rate: Literal["last block", "every trial"] = "last block"
    names: dict[str, Texts] = {}

    @property
    def has_welcome(self) -> bool:
        """Whether a participant first agrees to something or chooses a language."""
        return bool(self.consent) or len(self.languages) > 1

    def asks(self, when: str) -> tuple[Question, ...]:
        """Return the questions that are asked at "begin" or "end"."""
        return tuple(question for question in self.question if question.when == when)

    def is_rated(self, trial: int, trials: int, patterns: int) -> bool:
        """Return whether the pattern of this trial, counted from 0, is rated after its answer."""
        if not self.rating:
            return False
        return self.rate == "every trial" or trial >= trials - patterns

    def answers(self, when: str, values: Mapping[str, object]) -> dict[str, Answer | None]:
        """Check a page's answers and return one for each question, None where it has none.

        Raises StudyError, which names the question.
        """
        questions = {question.name: question for question in self.asks(when)}
        if unknown := set(values) - set(questions):
            raise StudyError(f"no question {min(unknown)!r} is open")
        return {name: _answer(each, values.get(name)) for name, each in questions.items()}

    def ratings(self, values: Mapping[str, object]) -> dict[str, int]:
        """Check a page's ratings and return them, all of the form's. Raises StudyError."""
        ratings = {}
        for rating in self.rating:
            value = values.get(rating.name)
            if type(value) is not int or not 1 <= value <= rating.steps:
                raise StudyError(f"rating {rating.name!r}: needs 1 to {rating.steps}")
            ratings[rating.name] = value
        return ratings


NOTHING = Form()  # the form of a study without a study.toml


class StudyFile(Struct, frozen=True, forbid_unknown_fields=True):
    """The plan and pace of a study, from the same file; None means the program's default.

    `settle_c` is how close to neutral the plate must be before a pattern, degC.
    """

    participants: int | tuple[str, ...] | None = None
    patterns: str | None = None
    pattern: tuple[dict[str, Any], ...] = ()
    repeats: int | None = None
    renderings: int | None = None
    order: Literal["blocked", "free"] | None = None
    seed: int | None = None
    rest_s: Annotated[float, Meta(ge=0.0, le=600.0)] = 3.0
    settle_c: Annotated[float, Meta(ge=0.1, le=20.0)] = 0.8
    masking_noise: bool = False

    def stimuli(self) -> tuple[Stimulus, ...] | None:
        """Return the patterns that the file itself contains, or None. Raises StudyError."""
        return stimuli.revive(self.pattern, FILE) if self.pattern else None


def read(folder: Path) -> tuple[Form, StudyFile] | None:
    """Read the study.toml of a folder; None where there is none. Raises StudyError."""
    path = folder / FILE
    if not path.exists():
        return None
    try:
        table = documents.read_toml(path, dict[str, Any])
        plan = {name: table.pop(name) for name in StudyFile.__struct_fields__ if name in table}
        file = msgspec.convert(plan, StudyFile)
        form = revive(table)
        for language in form.languages:
            languages.texts(language, folder)
    except OSError as error:
        raise StudyError(f"{path}: {error.strerror}") from None
    except (ValueError, StudyError) as error:
        raise StudyError(f"{path}: {documents.reason(error)}") from None
    return form, file


def revive(table: object) -> Form:
    """Convert and check a form, from study.toml or study.json. Raises StudyError."""
    try:
        form = msgspec.convert(table, Form)
    except msgspec.ValidationError as error:
        raise StudyError(str(error)) from None
    for fault in _faults(form):
        raise StudyError(fault)
    return form


def _faults(form: Form) -> list[str]:
    """Return everything that is wrong with a form."""
    names = [question.name for question in form.question] + [each.name for each in form.rating]
    faults = [f"two questions or ratings are named {n!r}" for n in names if names.count(n) > 1]
    faults += [f"name {n!r}: needs letters, digits and _" for n in names if not n.isidentifier()]
    if not form.languages or len(set(form.languages)) < len(form.languages):
        faults.append("languages: needs at least one, each once")
    faults += [f"language {n!r}: needs a code like en" for n in form.languages if not n.isalpha()]
    for question in form.question:
        if question.kind == "choice" and not 2 <= len(question.choice) <= _MAX_CHOICES:
            faults.append(f"question {question.name!r}: needs 2 to {_MAX_CHOICES} choices")
    for rating in form.rating:
        if not 2 <= rating.steps <= _MAX_STEPS:
            faults.append(f"rating {rating.name!r}: needs 2 to {_MAX_STEPS} steps")
    for where, texts in _all_texts(form):
        missing = [language for language in form.languages if not texts.get(language)]
        faults += [f"{where}: no text in {language!r}" for language in missing]
    return faults


def _all_texts(form: Form) -> list[tuple[str, Texts]]:
    """Return every text that is needed in each language, with the name of its place."""
    named = [
        (where, texts)
        for where in ("title", "consent", "instructions")
        if (texts := getattr(form, where))
    ]
    for question in form.question:
        named.append((f"question {question.name!r}", question.text))
        named += [(f"choice {each.value!r}", each.text) for each in question.choice]
    for rating in form.rating:
        ends = (rating.text, rating.low, rating.high)
        named += [(f"rating {rating.name!r}", texts) for texts in ends]
    return named


def _answer(question: Question, value: object) -> Answer | None:
    """Check one answer; an empty one is None. Raises StudyError."""
    if value is None or value == "":
        if question.needed:
            raise StudyError(f"question {question.name!r} needs an answer")
        return None
    if question.kind == "number":
        return _number(question, value)
    text = str(value)
    if question.kind == "choice" and text not in {choice.value for choice in question.choice}:
        raise StudyError(f"question {question.name!r}: no choice {text!r}")
    if len(text) > MAX_TEXT:
        raise StudyError(f"question {question.name!r}: at most {MAX_TEXT} characters")
    return text


def _number(question: Question, value: object) -> float:
    # bool is a subclass of int, and NaN fails both comparisons below.
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    low = -MAX_NUMBER if question.low is None else question.low
    high = MAX_NUMBER if question.high is None else question.high
    if not is_number or not low <= value <= high:  # type: ignore[operator]  # it is a number
        raise StudyError(f"question {question.name!r}: needs a number from {low:g} to {high:g}")
    return value  # type: ignore[return-value]  # as above
