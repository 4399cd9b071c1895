"""What a study shows and asks beside its patterns: consent, instructions, questions and ratings.

All of it comes from study.toml, every text once for each language of the study. Knows no page and
no device.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import msgspec
from msgspec import Struct

from hapticvlm import documents
from hapticvlm_studio.design import languages, stimuli
from hapticvlm_studio.design.stimuli import Stimulus, StudyError

FILE = "study.toml"
TEMPLATE = Path(__file__).parent / "new.toml"
MOST_NUMBER = 1e12  # where a question has no bounds: an answer is a finite number
LONGEST_TEXT = 2000  # characters of a free answer
_MOST_CHOICES = 20
_MOST_STEPS = 11

Texts = dict[str, str]  # by language
Answer = str | float


class Choice(Struct, frozen=True, forbid_unknown_fields=True):
    """One answer to choose: `value` stands in the data, `text` on the page."""

    value: str
    text: Texts


class Question(Struct, frozen=True, forbid_unknown_fields=True):
    """Asked once of each participant, before the training or after the last trial.

    `low` and `high` bound a number. Only a `needed` question must be answered.
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
    """A scale from 1 to `steps` on the pattern just answered; texts stand at its ends."""

    name: str
    text: Texts
    low: Texts
    high: Texts
    steps: int = 7


class Form(Struct, frozen=True, forbid_unknown_fields=True):
    """All that a study shows and asks; the first language is the one a page begins with.

    `names` translates words of patterns (vibrations and temperatures), by language.
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
        """Whether a participant agrees to something or chooses a language first."""
        return bool(self.consent) or len(self.languages) > 1

    def asks(self, when: str) -> tuple[Question, ...]:
        """Return the questions of this time."""
        return tuple(question for question in self.question if question.when == when)

    def is_rated(self, trial: int, trials: int, patterns: int) -> bool:
        """Whether the pattern of this trial is rated after its answer."""
        if not self.rating:
            return False
        return self.rate == "every trial" or trial >= trials - patterns

    def answers(self, when: str, given: Mapping[str, object]) -> dict[str, Answer | None]:
        """Check what a page gives as answers; None is an answer not given. Raises StudyError."""
        asked = {question.name: question for question in self.asks(when)}
        if unknown := set(given) - set(asked):
            raise StudyError(f"no question {min(unknown)!r} is open")
        return {name: _answer(each, given.get(name)) for name, each in asked.items()}

    def ratings(self, given: Mapping[str, object]) -> dict[str, int]:
        """Check what a page gives as ratings, all of them. Raises StudyError."""
        found = {}
        for rating in self.rating:
            value = given.get(rating.name)
            if type(value) is not int or not 1 <= value <= rating.steps:
                raise StudyError(f"rating {rating.name!r}: needs 1 to {rating.steps}")
            found[rating.name] = value
        return found


NOTHING = Form()  # what a study without a file of its own shows and asks


class StudyFile(Struct, frozen=True, forbid_unknown_fields=True):
    """How a study is laid out and paced, of the same file; None is what the program chooses."""

    participants: int | tuple[str, ...] | None = None
    patterns: str | None = None
    pattern: tuple[dict[str, Any], ...] = ()
    repeats: int | None = None
    renderings: int | None = None
    order: Literal["blocked", "free"] | None = None
    seed: int | None = None
    rest_s: float | None = None
    masking_noise: bool | None = None

    def stimuli(self) -> tuple[Stimulus, ...] | None:
        """Return the patterns that the file itself holds, if any. Raises StudyError."""
        return stimuli.revive(self.pattern, FILE) if self.pattern else None


def read(folder: Path) -> tuple[Form, StudyFile] | None:
    """Read a folder's study.toml; None where there is none. Raises StudyError."""
    path = folder / FILE
    if not path.exists():
        return None
    try:
        table = documents.parse_toml(documents.read_text(path))
        plan = {name: table.pop(name) for name in StudyFile.__struct_fields__ if name in table}
        found = msgspec.convert(plan, StudyFile)
        form = revive(table)
        for language in form.languages:
            languages.texts(language, folder)
    except OSError as error:
        raise StudyError(f"{path}: {error.strerror}") from None
    except (ValueError, StudyError) as error:
        raise StudyError(f"{path}: {error}") from None
    return form, found


def revive(table: object) -> Form:
    """Read a form, from study.toml or study.json. Raises StudyError."""
    try:
        form = msgspec.convert(table, Form)
    except msgspec.ValidationError as error:
        raise StudyError(str(error)) from None
    for fault in _faults(form):
        raise StudyError(fault)
    return form


def _faults(form: Form) -> list[str]:
    """Return what is wrong with a form."""
    names = [question.name for question in form.question] + [each.name for each in form.rating]
    found = [f"two questions or ratings are named {n!r}" for n in names if names.count(n) > 1]
    found += [f"name {n!r}: needs letters, digits and _" for n in names if not n.isidentifier()]
    if not form.languages or len(set(form.languages)) < len(form.languages):
        found.append("languages: needs at least one, each once")
    found += [f"language {n!r}: needs a code like en" for n in form.languages if not n.isalpha()]
    for question in form.question:
        if question.kind == "choice" and not 2 <= len(question.choice) <= _MOST_CHOICES:
            found.append(f"question {question.name!r}: needs 2 to {_MOST_CHOICES} choices")
    for rating in form.rating:
        if not 2 <= rating.steps <= _MOST_STEPS:
            found.append(f"rating {rating.name!r}: needs 2 to {_MOST_STEPS} steps")
    for where, texts in _all_texts(form):
        lacking = [language for language in form.languages if not texts.get(language)]
        found += [f"{where}: no text in {language!r}" for language in lacking]
    return found


def _all_texts(form: Form) -> list[tuple[str, Texts]]:
    """Return every text that must be there in each language, with the name of its place."""
    found = [
        (where, texts)
        for where in ("title", "consent", "instructions")
        if (texts := getattr(form, where))
    ]
    for question in form.question:
        found.append((f"question {question.name!r}", question.text))
        found += [(f"choice {each.value!r}", each.text) for each in question.choice]
    for rating in form.rating:
        ends = (rating.text, rating.low, rating.high)
        found += [(f"rating {rating.name!r}", texts) for texts in ends]
    return found


def _answer(question: Question, given: object) -> Answer | None:
    """Check one answer. Raises StudyError."""
    if given is None or given == "":
        if question.needed:
            raise StudyError(f"question {question.name!r} needs an answer")
        return None
    if question.kind == "number":
        return _number(question, given)
    text = str(given)
    if question.kind == "choice" and text not in {choice.value for choice in question.choice}:
        raise StudyError(f"question {question.name!r}: no choice {text!r}")
    if len(text) > LONGEST_TEXT:
        raise StudyError(f"question {question.name!r}: at most {LONGEST_TEXT} characters")
    return text


def _number(question: Question, given: object) -> float:
    is_number = isinstance(given, int | float) and not isinstance(given, bool)
    low = -MOST_NUMBER if question.low is None else question.low
    high = MOST_NUMBER if question.high is None else question.high
    if not is_number or not low <= given <= high:  # type: ignore[operator]  # it is a number
        raise StudyError(f"question {question.name!r}: needs a number from {low:g} to {high:g}")
    return given  # type: ignore[return-value]  # as above
