"""The study: balanced orders, a log that loses no answered trial, patterns, how far one came."""

from collections import Counter
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from each_case import each_row
from word_tables import cases, words

from hapticvlm.materials import MATERIALS
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import LEAD_S, share, thermal_contact
from hapticvlm.rendering.heat.trajectory import BRIEF_LIFT_S
from hapticvlm_studio.design import design as designs
from hapticvlm_studio.design import stimuli
from hapticvlm_studio.design.design import Plan, blocked_orders, free_orders, square
from hapticvlm_studio.design.patterns import paper_like
from hapticvlm_studio.design.stimuli import LIFT_S, Part, StudyError, parts
from hapticvlm_studio.trials import record
from hapticvlm_studio.trials.progress import ParticipantProgress
from hapticvlm_studio.trials.record import Log

NAMES = [stimulus.name for stimulus in paper_like()]


@pytest.mark.parametrize("patterns", [2, 3, 5, 8, 10, 20])
def test_in_a_square_every_pattern_follows_every_other_equally_often(patterns: int) -> None:
    rows = square(patterns)
    follows = Counter(pair for row in rows for pair in pairwise(row))
    assert all(sorted(row) == list(range(patterns)) for row in rows)
    assert len(follows) == patterns * (patterns - 1)
    assert set(follows.values()) == {1 if patterns % 2 == 0 else 2}
    for place in range(patterns):
        assert len(set(Counter(row[place] for row in rows).values())) == 1


def test_each_block_presents_each_pattern_once() -> None:
    for trials in blocked_orders(NAMES, participants=7, repeats=5, seed=3):
        blocks = [trials[at : at + 10] for at in range(0, 50, 10)]
        assert all(sorted(block) == sorted(NAMES) for block in blocks)


def test_ten_blocks_in_a_row_balance_what_comes_before() -> None:
    two_people = blocked_orders(NAMES, participants=2, repeats=5, seed=8)
    blocks = [trials[at : at + 10] for trials in two_people for at in range(0, 50, 10)]
    follows = Counter(pair for block in blocks for pair in pairwise(block))
    assert set(follows.values()) == {1}


def test_a_free_order_has_every_pattern_as_often_and_no_blocks() -> None:
    people = free_orders(NAMES, participants=9, repeats=5, seed=3)
    assert all(Counter(trials) == dict.fromkeys(NAMES, 5) for trials in people)
    ends = [trials[at : at + 10] for trials in people for at in range(0, 50, 10)]
    assert sum(len(set(end)) < 10 for end in ends) > 40
    assert people == free_orders(NAMES, 9, 5, seed=3)
    assert len(set(people)) == 9


def test_the_seed_decides_the_orders_and_people_differ() -> None:
    first = blocked_orders(NAMES, 3, 5, seed=1)
    assert first == blocked_orders(NAMES, 3, 5, seed=1)
    assert first != blocked_orders(NAMES, 3, 5, seed=2)
    assert len(set(first)) == 3


@pytest.fixture
def design() -> designs.Design:
    return designs.design(paper_like(), ("ann", "ben"), Plan())


def test_a_torn_line_is_cut_off_and_every_whole_event_kept(tmp_path: Path) -> None:
    first = Log(tmp_path, "ann")
    first.add({"event": "felt", "pattern": "x"})
    first.close()
    path = tmp_path / "ann.jsonl"
    path.write_bytes(path.read_bytes() + b'{"event": "answ')
    assert [event["event"] for event in record.events(tmp_path, "ann")] == ["felt"]
    again = Log(tmp_path, "ann")
    again.add({"event": "trained"})
    again.close()
    assert [event["event"] for event in record.events(tmp_path, "ann")] == ["felt", "trained"]


def test_how_far_each_came_is_known_without_reading_their_files_again(
    design: designs.Design, tmp_path: Path
) -> None:
    kept = record.Record(design, tmp_path)
    assert [each["answered"] for each in kept.participants()] == [0, 0]
    kept.open("ann")
    name = design.trials["ann"][0]
    kept.note({"event": "answered", "trial": 0, "pattern": name, "answered": name})
    assert [each["answered"] for each in kept.participants()] == [1, 0]
    kept.close()
    (tmp_path / "ann.jsonl").unlink()
    assert [each["answered"] for each in kept.participants()] == [1, 0]


def test_two_programs_cannot_run_one_study(tmp_path: Path) -> None:
    pytest.importorskip("fcntl", reason="file locks of this kind are of Unix")
    with (
        record.locked(tmp_path),
        pytest.raises(StudyError, match="another"),
        record.locked(tmp_path),
    ):
        pass


def test_codes_of_people_are_names_of_files_of_their_own_on_every_system() -> None:
    refused: list[tuple[tuple[str, ...], str]] = [(("p1", "P1"), "the same file")]
    refused += [(("P1", name), "Windows has") for name in ("CON", "nul", "Com1", "lpt9", "COM²")]
    refused += [(codes, ".") for codes in (("a", "a"), ("../x",), ("a/b",), ("",), ())]
    for codes, said in refused:
        with pytest.raises(StudyError, match=said):
            designs.design(paper_like(), codes, Plan())
    sound = ("CONNY", "COM10")
    assert designs.design(paper_like(), sound, Plan()).participants == sound


def test_a_trial_counts_once_answered_and_is_presented_again_otherwise(
    design: designs.Design,
) -> None:
    progress = ParticipantProgress(design, "ann")
    head = {"trial": 0, "pattern": design.trials["ann"][0]}
    progress.apply({"event": "presented", **head})
    progress.apply({"event": "spoiled", **head})
    assert progress.next_trial == design.trials["ann"][0]
    progress.apply({"event": "presented", **head})
    assert progress.attempts == 2
    progress.apply({"event": "answered", "answered": head["pattern"], **head})
    assert (progress.answered, progress.correct, progress.attempts) == (1, 1, 0)
    assert progress.next_trial == design.trials["ann"][1]


def test_training_asks_for_the_pattern_felt_least_until_all_were_felt_enough(
    design: designs.Design,
) -> None:
    progress = ParticipantProgress(design, "ann")
    felt = []
    while (name := progress.next_to_feel) is not None:
        felt.append(name)
        progress.apply({"event": "felt", "pattern": name})
    assert Counter(felt) == dict.fromkeys(NAMES, 3)
    assert felt[:10] == NAMES


def test_the_time_left_is_that_of_the_trials_left_at_the_usual_pace_of_this_session(
    design: designs.Design,
) -> None:
    progress, names = ParticipantProgress(design, "ann"), design.trials["ann"]
    for trial, t_s in enumerate([5.0, 10.0, 16.0, 22.0, 900.0, 3.0, 6.0]):
        if trial == 5:
            assert progress.seconds_left == pytest.approx(6.0 * (len(names) - 5))
            progress.apply({"event": "opened"})
        told = {"trial": trial, "pattern": names[trial], "answered": names[trial], "t_s": t_s}
        progress.apply({"event": "answered", **told})
        assert (progress.seconds_left is None) is (trial in (0, 5))
    assert progress.seconds_left == pytest.approx(3.0 * (len(names) - 7))


def test_an_object_brings_skin_to_the_setpoint_when_its_pattern_ends() -> None:
    for stimulus in paper_like():
        contact = thermal_contact(MATERIALS[stimulus.material].thermal, stimulus.object_c)
        held_s = stimulus.lead_s + stimulus.seconds
        change_c = share(contact, held_s) * (stimulus.object_c - NEUTRAL_C)
        assert NEUTRAL_C + change_c == pytest.approx(stimulus.setpoint_c, abs=1e-6)


@each_row(("change", "said"), cases(Path(__file__).with_name("patterns.json"), "unplayable"))
def test_a_pattern_that_cannot_be_played_is_refused(change: dict[str, object], said: str) -> None:
    with pytest.raises(StudyError, match=said):
        replace(paper_like()[0], **change)  # type: ignore[arg-type]


@each_row(("text", "said"), words(Path(__file__).with_name("wrong.csv"), "patterns"))
def test_a_file_of_patterns_that_is_wrong_says_where(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(text)
    with pytest.raises(StudyError, match=said):
        stimuli.read(path)


def test_patterns_must_differ_in_name_and_in_factors() -> None:
    one, two, *_ = paper_like()
    with pytest.raises(StudyError, match="share"):
        stimuli.checked([one, replace(two, name=one.name)])
    with pytest.raises(StudyError, match="share"):
        stimuli.checked([one, replace(one, name="other")])
    with pytest.raises(StudyError, match="2 to"):
        stimuli.checked([one])


@pytest.mark.parametrize("lead_s", [LEAD_S, 0.3, 6.0])
def test_the_hand_leads_and_strokes_for_as_long_as_the_pattern_says(lead_s: float) -> None:
    taps = replace(paper_like()[1], lead_s=lead_s)
    course = parts(taps)
    first = next(i for i, part in enumerate(course) if part.phase == "contact")
    assert sum(part.seconds for part in course[:first]) == pytest.approx(lead_s)
    assert sum(part.seconds for part in course[first:]) == pytest.approx(taps.seconds)
    assert [part.phase for part in course].count("contact") == taps.repeats
    assert course[0] == Part("approach", min(lead_s, LEAD_S) if lead_s == 6.0 else lead_s)
    assert course[-1].phase == "contact"


def test_a_lift_is_brief_enough_for_the_plate_to_take_strokes_as_one_contact() -> None:
    assert LIFT_S + 0.02 < BRIEF_LIFT_S
