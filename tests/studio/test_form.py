"""What a study asks beside its patterns: read whole or refused, in every language of the study."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any, get_args

import pytest
from each_case import each_row
from word_tables import words

from hapticvlm.commands.main import main
from hapticvlm_studio.design import design as designs
from hapticvlm_studio.design import form as forms
from hapticvlm_studio.design import languages
from hapticvlm_studio.design.design import Plan
from hapticvlm_studio.design.form import Form
from hapticvlm_studio.design.layout import layout
from hapticvlm_studio.design.patterns import ours, twenty
from hapticvlm_studio.design.stimuli import StudyError
from hapticvlm_studio.trials import page_server
from hapticvlm_studio.trials.conductor import Phase
from hapticvlm_studio.trials.progress import ParticipantProgress

PAGES = page_server.PAGES[0]
SHIPPED = sorted(path.stem for path in languages.SHIPPED.glob("*.toml"))


@pytest.fixture
def form(tmp_path: Path) -> Form:
    """The form of a study that was just begun."""
    assert main(["study", "new", str(tmp_path)]) == 0
    found = forms.read(tmp_path)
    assert found is not None
    return found[0]


def leaves(table: dict[str, Any], above: str = "") -> dict[str, str]:
    found: dict[str, str] = {}
    for name, value in table.items():
        if name == "names":
            continue
        if isinstance(value, dict):
            found |= leaves(value, f"{above}{name}.")
        else:
            found[above + name] = " ".join(value) if isinstance(value, list) else value
    return found


def test_a_new_study_asks_for_consent_age_handedness_and_two_ratings(form: Form) -> None:
    assert form.languages == ("en", "de")
    assert form.has_welcome
    assert [question.name for question in form.asks("begin")] == ["age", "handedness"]
    assert [question.kind for question in form.asks("end")] == ["text"]
    assert [rating.name for rating in form.rating] == ["real", "pleasant"]


def test_a_pilot_plays_every_pattern_once_in_training_and_once_as_a_trial(tmp_path: Path) -> None:
    for folder, more in (("whole", []), ("pilot", ["--pilot"])):
        assert main(["study", "new", str(tmp_path / folder), *more]) == 0
    whole, pilot = (
        tomllib.loads((tmp_path / folder / "study.toml").read_text(encoding="utf-8"))
        for folder in ("whole", "pilot")
    )
    assert whole["repeats"] > 1
    assert whole["renderings"] > 1
    assert pilot == whole | {"participants": 1, "repeats": 1, "renderings": 1}


def test_the_file_of_a_new_study_is_not_written_over(tmp_path: Path) -> None:
    assert main(["study", "new", str(tmp_path)]) == 0
    assert main(["study", "new", str(tmp_path)]) == 2


@pytest.mark.parametrize("language", SHIPPED)
def test_every_language_has_every_text_with_the_same_words_to_fill_in(language: str) -> None:
    english = leaves(languages.texts("en", Path("nowhere")))
    found = leaves(languages.texts(language, Path("nowhere")))
    assert found.keys() == english.keys()
    for name, text in found.items():
        assert set(re.findall(r"\{\w+\}", text)) == set(re.findall(r"\{\w+\}", english[name])), name


def test_every_text_that_the_participants_page_asks_for_is_in_the_language() -> None:
    """A key that is in no language would be shown as nothing."""
    english = leaves(languages.texts("en", Path("nowhere")))
    sources = [path.read_text(encoding="utf-8") for path in PAGES.glob("study.*")]
    written = r"""(?:text\(|data-text=|\? |: )"((?:buttons|page)\.\w+)\""""
    asked = {key for source in sources for key in re.findall(written, source)}
    phases = {
        f"phases.{name}" for source in sources for name in re.findall(r'phase\("(\w+)"', source)
    }
    assert len(asked) > 15
    assert asked | phases | {f"phases.{name}" for name in get_args(Phase)} <= english.keys()
    others = {key for key in english if not key.startswith(("phases.", "heard."))}
    assert others - asked == {"language"}


def test_in_a_pilot_by_ear_no_text_speaks_of_a_palm_a_device_or_of_feeling() -> None:
    unfit = {"en": r"\bpalm|\bdevice|\bfe(?:el|lt)|\bplate", "de": r"Hand|Gerät|[Ss]pür|Platte"}
    for language, pattern in unfit.items():
        texts = languages.texts(language, Path("nowhere"))
        assert texts["heard"].keys() <= texts["phases"].keys()
        shown = {**texts["phases"], **texts["heard"]}
        # The consent says that the study's own text is for a device; trouble is the experimenter's.
        named = {name for name, text in shown.items() if re.search(pattern, " ".join(text))}
        assert named <= {"consent", "trouble"}, language


def test_german_names_every_shipped_pattern() -> None:
    named = languages.texts("de", Path("nowhere"))["names"]
    shown = {word for one in (*ours(), *twenty()) for word in (one.vibration, one.temperature)}
    assert shown <= named.keys()


def test_a_language_of_one_s_own_lies_beside_the_study_and_is_whole(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=r"shipped are de, en; .*fr\.toml"):
        languages.texts("fr", tmp_path)
    english = (languages.SHIPPED / "en.toml").read_text()
    (tmp_path / "fr.toml").write_text(english.replace('"English"', '"Français"'))
    assert languages.texts("fr", tmp_path)["language"] == "Français"
    (tmp_path / "it.toml").write_text('language = "Italiano"')
    with pytest.raises(StudyError, match=r"it\.toml: lacks buttons\."):
        languages.texts("it", tmp_path)


@each_row(("change", "said"), words(Path(__file__).with_name("wrong.csv"), "study file"))
def test_a_study_file_that_is_wrong_says_what(change: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(change)
    with pytest.raises(StudyError, match=said) as caught:
        forms.read(tmp_path)
    assert "study.toml" in str(caught.value)


def test_answers_are_checked_and_what_is_not_given_is_missing(form: Form) -> None:
    assert form.answers("begin", {"age": 31}) == {"age": 31, "handedness": None}
    assert form.answers("end", {"remarks": ""}) == {"remarks": None}
    for wrong, said in (
        ({"age": 7}, "from 18"),
        ({"age": "31"}, "a number"),
        ({"age": True}, "a number"),
        ({"age": float("nan")}, "a number"),
        ({"handedness": "third"}, "no choice"),
        ({"name": "Ann"}, "no question 'name'"),
    ):
        with pytest.raises(StudyError, match=said):
            form.answers("begin", wrong)
    with pytest.raises(StudyError, match="2000 characters"):
        form.answers("end", {"remarks": "x" * 2001})


def test_a_needed_question_must_be_answered() -> None:
    table = {"name": "a", "kind": "text", "text": {"en": "?"}, "needed": True}
    needed = forms.revive({"question": [table]})
    with pytest.raises(StudyError, match="needs an answer"):
        needed.answers("begin", {})


def test_ratings_are_whole_and_on_their_scale(form: Form) -> None:
    assert form.ratings({"real": 1, "pleasant": 7}) == {"real": 1, "pleasant": 7}
    for wrong in ({"real": 1}, {"real": 0, "pleasant": 1}, {"real": 8, "pleasant": 1},
                  {"real": 2.5, "pleasant": 1}, {"real": True, "pleasant": 1}):  # fmt: skip
        with pytest.raises(StudyError, match="needs 1 to 7"):
            form.ratings(wrong)


def test_in_balanced_blocks_each_pattern_is_rated_once_by_each_participant(form: Form) -> None:
    made = designs.design(ours(), ["ann"], Plan(form=form))
    trials = made.trials["ann"]
    rated = [name for at, name in enumerate(trials) if form.is_rated(at, len(trials), 10)]
    assert sorted(rated) == sorted(one.name for one in ours())
    assert not Form().is_rated(49, 50, 10)


def test_a_participant_goes_from_consent_by_questions_and_ratings_to_the_end(form: Form) -> None:
    made = designs.design(ours(), ["ann"], Plan(repeats=1, renderings=0, form=form))
    progress = ParticipantProgress(made, "ann")
    stages = [progress.stage]
    told = ({"event": "agreed", "language": "de"}, {"event": "told", "when": "begin"})
    for event in (*told, {"event": "trained"}):
        progress.apply(event)
        stages.append(progress.stage)
    for trial, name in enumerate(made.trials["ann"]):
        head = {"trial": trial, "pattern": name}
        progress.apply({"event": "answered", **head, "answered": name, "t_s": 10.0 * trial})
        assert progress.to_rate == trial
        assert not progress.is_done
        progress.apply({"event": "rated", **head})
    stages.append(progress.stage)
    assert (progress.questions, progress.language, progress.seconds_left) == ("end", "de", 0.0)
    progress.apply({"event": "told", "when": "end"})
    stages.append(progress.stage)
    assert stages == ["consent", "questions", "training", "ready", "questions", "done"]


def test_the_time_left_is_the_pace_of_this_run_times_what_is_left() -> None:
    made = designs.design(ours(), ["ann"], Plan(repeats=1))
    progress = ParticipantProgress(made, "ann")
    for t_s in (3.0, 15.0, 27.0, 900.0, 912.0):  # with a long pause
        progress.apply({"event": "answered", "pattern": "x", "answered": "x", "t_s": t_s})
    assert progress.seconds_left == 12.0 * 5
    progress.apply({"event": "opened"})
    assert progress.seconds_left is None


def test_order_and_form_are_kept_with_the_study(form: Form, tmp_path: Path) -> None:
    made = designs.design(ours(), ["ann", "ben"], Plan(order="free", form=form))
    designs.write_design(tmp_path, made)
    assert designs.read_design(tmp_path) == made
    assert json.loads((tmp_path / designs.HEAD).read_text())["version"] == 2


def test_a_study_of_another_format_is_refused(tmp_path: Path) -> None:
    made = designs.design(ours(), ["ann"], Plan())
    designs.write_design(tmp_path, made)
    head = json.loads((tmp_path / designs.HEAD).read_text())
    (tmp_path / designs.HEAD).write_text(json.dumps(head | {"version": 3}))
    with pytest.raises(StudyError, match="format 3; this program reads 2"):
        designs.read_design(tmp_path)


def test_the_file_lays_the_study_out_and_stays_as_it_was_begun(form: Form, tmp_path: Path) -> None:
    made, _ = layout(tmp_path)
    assert len(made.participants) == 9
    assert made.form == form
    assert layout(tmp_path)[0] == made
    path = tmp_path / "study.toml"
    path.write_text(path.read_text().replace("How old are you?", "Your age?"))
    with pytest.raises(StudyError, match=r"had begun \(question\)"):
        layout(tmp_path)


def test_a_misspelt_folder_begins_no_study_and_names_the_one_that_was_meant(tmp_path: Path) -> None:
    (tmp_path / "pilot").mkdir()
    (tmp_path / "pilot" / "study.toml").write_text(forms.TEMPLATE.read_text())
    with pytest.raises(StudyError, match=r"did you mean .*pilot\?"):
        layout(tmp_path / "pilto")
    assert not (tmp_path / "pilto").exists()


def test_patterns_of_one_s_own_stand_in_the_same_file(tmp_path: Path) -> None:
    lines = (forms.TEMPLATE).read_text().split("# [[pattern]]")[1].splitlines()[1:]
    table = "\n".join(line.removeprefix("# ") for line in lines)
    hot = tomllib.loads(table)
    cold = table.replace('"cork-tapping-hot"', '"cork-tapping-cold"').replace('"hot"', '"cold"')
    both = f"[[pattern]]\n{table}\n[[pattern]]\n{cold.replace('36.0', '26.0')}"
    (tmp_path / "study.toml").write_text(f"repeats = 2\n{both}")
    made, _ = layout(tmp_path)
    assert [one.name for one in made.stimuli] == ["cork-tapping-hot", "cork-tapping-cold"]
    assert made.stimuli[0].speed_mps == hot["speed_mps"]
