"""The ladder: who is believed, when climbing stops, and what keeps a label from flickering."""

import dataclasses
import itertools
from random import Random

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hapticvlm import materials
from hapticvlm.evidence.ladder import (
    FLIP_MARGIN,
    KNOWN,
    SURE,
    Evidence,
    Rung,
    apply_hysteresis,
    decide,
    fuse,
    is_sure,
    pool,
    restrict,
)


def says(rung: Rung, **beliefs: float) -> Evidence:
    ranked = sorted(beliefs.items(), key=lambda item: -item[1])
    return Evidence(rung, tuple(ranked))


WOOD_SURE = says("name", wood=0.93)
METAL_SEEN = says("encoder", metal=0.7, glass=0.1)


def test_without_evidence_the_material_is_unknown() -> None:
    for evidence in ([], [Evidence("encoder", ())]):
        verdict = decide(evidence)
        assert verdict.material == materials.UNKNOWN
        assert verdict.source == "unknown"
        assert verdict.confidence == 0.0
        assert verdict.runner_up is None
        assert not is_sure(evidence)


def test_the_scene_wins_outright_wherever_it_stands() -> None:
    scene = says("scene", glass=1.0)
    for evidence in itertools.permutations([scene, WOOD_SURE, METAL_SEEN]):
        verdict = decide(evidence)
        assert (verdict.material, verdict.confidence, verdict.source) == ("glass", 1.0, "scene")
        assert is_sure(evidence)


def test_the_scene_wins_also_when_it_is_in_doubt_itself() -> None:
    evidence = [says("scene", glass=0.6), WOOD_SURE]
    assert (decide(evidence).material, decide(evidence).source) == ("glass", "scene")
    assert is_sure(evidence[:1])


def test_one_sure_rung_stops_and_cheaper_rungs_come_first() -> None:
    assert is_sure([WOOD_SURE])
    verdict = decide([says("encoder", metal=0.95), WOOD_SURE])
    assert (verdict.material, verdict.source) == ("wood", "name")
    assert verdict.confidence == pytest.approx(0.93)


def test_a_doubtful_rung_does_not_stop_the_climb() -> None:
    assert not is_sure([says("name", wood=SURE - 0.01)])


def test_two_doubtful_rungs_that_agree_are_surer_than_either() -> None:
    together = [says("name", wood=0.7), says("encoder", wood=0.6)]
    assert decide(together).material == "wood"
    assert decide(together).confidence > 0.9
    assert is_sure(together)


def test_what_is_alive_is_never_named_and_a_sure_name_outweighs_it() -> None:
    dog = says("encoder", living=0.9, leather=0.05)
    assert decide([dog]).material == materials.UNKNOWN
    assert decide([dog]).runner_up is None
    assert decide([WOOD_SURE, dog]).material == "wood"
    assert restrict(dog, ["metal"]).material == materials.LIVING


def test_rungs_that_disagree_alike_leave_it_unknown_with_a_best_guess() -> None:
    verdict = decide([says("name", wood=0.6), says("encoder", metal=0.6)])
    assert verdict.material == materials.UNKNOWN
    assert verdict.source == "unknown"
    assert verdict.confidence < KNOWN
    assert verdict.runner_up in ("wood", "metal")


def test_a_rung_without_knowledge_does_not_move_a_belief() -> None:
    name = says("name", wood=0.72)
    alone, beside = decide([name]), decide([name, says("encoder", metal=0.01, wood=0.01)])
    assert beside.material == "wood"
    assert beside.confidence == pytest.approx(alone.confidence, abs=0.06)


def test_a_rung_that_rejects_its_own_best_guess_does_not_speak_against_it() -> None:
    shader = says("shader", glass=0.75)
    beside = decide([shader, says("encoder", glass=0.016, paper=0.01, wood=0.008)])
    assert (beside.material, beside.source) == ("glass", "shader")
    assert beside.confidence >= decide([shader]).confidence


def test_a_sure_rung_is_not_weakened_by_doubtful_ones_that_agree() -> None:
    doubtful = [says("name", wood=0.75), says("encoder", wood=0.79)]
    together = decide(doubtful).confidence
    for sure in (says("shader", wood=SURE), says("vlm", wood=SURE)):
        assert decide([*doubtful, sure]).confidence >= together > SURE


def test_a_sure_rung_keeps_its_belief_against_one_that_disagrees() -> None:
    verdict = decide([WOOD_SURE, says("encoder", metal=0.95)])
    assert (verdict.material, verdict.runner_up) == ("wood", "metal")
    assert verdict.confidence == pytest.approx(0.93)


def test_beside_a_name_a_shader_counts_less_the_surer_the_name_is() -> None:
    shader = says("shader", metal=0.75)
    against = [pool([says("name", wood=belief), shader]) for belief in (0.001, 0.4, 0.75)]
    assert against[0]["metal"] == pytest.approx(0.75, abs=0.01)
    assert against[1]["metal"] > against[1]["wood"]
    assert against[2]["metal"] < against[2]["wood"]


def test_beside_a_texture_map_a_frame_counts_less_since_it_shows_the_same_pixels() -> None:
    frame = says("encoder", wood=0.6)
    alone = pool([frame, says("vlm", wood=0.6)])
    assert pool([frame, says("texture", wood=0.6)])["wood"] < alone["wood"]
    assert pool([frame, says("texture", wood=0.6)])["wood"] > 0.6
    assert decide([says("texture", wood=0.85), says("encoder", metal=0.7)]).source == "texture"


def test_the_source_is_the_rung_that_speaks_most_for_the_answer() -> None:
    evidence = [says("name", wood=0.3, metal=0.3), says("encoder", wood=0.75)]
    assert decide(evidence).source == "encoder"


def test_a_label_flips_only_with_a_margin() -> None:
    wood = decide([says("encoder", wood=0.6)])
    close = decide([says("encoder", metal=0.52, wood=0.45)])
    clear = decide([says("encoder", metal=0.7, wood=0.2)])
    assert close.material == clear.material == "metal"
    kept = apply_hysteresis(wood, close)
    assert (kept.material, kept.runner_up) == ("wood", "metal")
    assert kept.confidence == pytest.approx(0.45)
    assert kept.evidence == close.evidence
    assert apply_hysteresis(wood, clear) is clear


def test_flicker_around_the_known_threshold_is_held() -> None:
    wood = decide([says("encoder", wood=0.55)])
    weaker = decide([says("encoder", wood=KNOWN - 0.05)])
    lost = decide([says("encoder", wood=KNOWN - FLIP_MARGIN - 0.05)])
    assert weaker.material == materials.UNKNOWN
    assert apply_hysteresis(wood, weaker).material == "wood"
    assert apply_hysteresis(wood, lost).material == materials.UNKNOWN


def test_the_scene_and_the_first_answer_need_no_margin() -> None:
    wood = decide([says("encoder", wood=0.95)])
    scene = decide([says("scene", metal=1.0)])
    unknown = decide([])
    assert apply_hysteresis(None, wood) is wood
    assert apply_hysteresis(wood, scene) is scene
    assert apply_hysteresis(unknown, wood) is wood


def test_views_of_one_object_are_averaged() -> None:
    fused = fuse([says("encoder", wood=0.8, metal=0.1), says("encoder", wood=0.4, glass=0.4)])
    assert fused.rung == "encoder"
    assert fused.material == "wood"
    assert fused.confidence == pytest.approx(0.6)
    assert sum(belief for _, belief in fused.beliefs) <= 1.0 + 1e-9


def test_fusing_one_view_changes_nothing_and_no_view_gives_no_evidence() -> None:
    assert fuse([METAL_SEEN]) == METAL_SEEN
    assert fuse([]) == Evidence("encoder", ())
    assert fuse([Evidence("encoder", ())]).material is None


def known_names() -> st.SearchStrategy[str]:
    return st.sampled_from([*sorted(materials.MATERIALS), "obsidian"])


RUNGS: list[Rung] = ["name", "shader", "encoder", "vlm"]


@st.composite
def evidences(draw: st.DrawFn) -> Evidence:
    """Any evidence a rung may give, with beliefs of nothing and of everything among them."""
    rung = draw(st.sampled_from(RUNGS))
    names = draw(st.lists(known_names(), unique=True, max_size=12))
    raw = [draw(st.sampled_from([0.0, 1e-9, 1.0]) | st.floats(0.0, 1.0)) for _ in names]
    total = max(1.0, sum(raw))
    return says(rung, **{name: p / total for name, p in zip(names, raw, strict=True)})


@st.composite
def silences(draw: st.DrawFn) -> Evidence:
    names = draw(st.lists(known_names(), unique=True, max_size=3))
    return Evidence(draw(st.sampled_from(RUNGS)), tuple((name, 0.0) for name in names))


several = st.lists(evidences(), max_size=5)


@settings(deadline=None)
@given(several)
def test_all_beliefs_are_probabilities_and_leave_room_for_unknown(evidence: list[Evidence]) -> None:
    posterior = pool(evidence)
    assert all(0.0 <= belief <= 1.0 for belief in posterior.values())
    assert sum(posterior.values()) <= 1.0 + 1e-9
    verdict = decide(evidence)
    assert 0.0 <= verdict.confidence <= 1.0
    assert verdict.material in (*materials.MATERIALS, "obsidian", materials.UNKNOWN)
    assert verdict.runner_up != verdict.material
    assert verdict == decide(evidence)
    assert apply_hysteresis(verdict, verdict) is verdict
    assert is_sure(evidence) == (verdict.confidence >= SURE)


@settings(deadline=None)
@given(several, several)
def test_a_verdict_has_the_posterior_even_while_hysteresis_keeps_a_label(
    before: list[Evidence], now: list[Evidence]
) -> None:
    held = apply_hysteresis(decide(before), decide(now))
    assert held.evidence == tuple(now)
    believes = any(belief > 0.0 for item in now for _, belief in item.beliefs)
    assert held.beliefs == (pool(now) if believes else {})


@settings(deadline=None)
@given(several, st.randoms())
def test_the_order_of_evidence_does_not_matter(evidence: list[Evidence], luck: Random) -> None:
    shuffled = list(evidence)
    luck.shuffle(shuffled)
    one, other = decide(evidence), decide(shuffled)
    assert dataclasses.replace(one, evidence=()) == dataclasses.replace(other, evidence=())
    assert pool(evidence) == pool(shuffled)


@settings(deadline=None)
@given(several, silences(), st.integers(0, 5))
def test_a_rung_without_beliefs_changes_nothing(
    evidence: list[Evidence], silent: Evidence, place: int
) -> None:
    beside = [*evidence[:place], silent, *evidence[place:]]
    one, other = decide(evidence), decide(beside)
    assert (one.material, one.runner_up, one.source) == (
        other.material,
        other.runner_up,
        other.source,
    )
    assert other.confidence == pytest.approx(one.confidence, abs=1e-9)


@settings(deadline=None)
@given(several, evidences())
def test_another_rung_that_agrees_never_makes_another_material_the_likeliest(
    evidence: list[Evidence], more: Evidence
) -> None:
    # As in a session, where the views of one rung are fused. Of three rungs that contradict each
    # other a fourth may tip the balance, since it discounts those that share its hints.
    rungs = [item.rung for item in (*evidence, more)]
    assume(len(set(rungs)) == len(rungs) <= 3)
    before = pool(evidence)
    best = max(before, key=lambda name: before[name])
    swap = {more.material: best, best: more.material}
    agreeing = Evidence(more.rung, tuple((swap.get(n, n) or n, p) for n, p in more.beliefs))
    after = pool([*evidence, agreeing])
    assert after[best] >= max(after.values()) - 1e-6


@settings(deadline=None)
@given(evidences())
def test_a_rung_alone_is_believed_as_it_is(alone: Evidence) -> None:
    assert decide([alone]).confidence == pytest.approx(alone.confidence, abs=2e-3)


def test_what_the_scene_cannot_have_gives_its_mass_to_what_it_can() -> None:
    seen = Evidence("encoder", (("wood", 0.5), ("glass", 0.3), ("metal", 0.1)))
    few = restrict(seen, ("glass", "metal"))
    assert dict(few.beliefs) == pytest.approx({"glass": 0.6, "metal": 0.2})
    assert restrict(seen, None) == seen
    assert restrict(seen, ("paper",)).beliefs == ()
