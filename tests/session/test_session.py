"""The session's state machine: messages and times in, actions out; no socket, no clock."""

import dataclasses

import msgspec
import pytest
from each_case import each_row
from session_messages import READING, TABLE, frame, only, owner, replies, scene, touch

from hapticvlm.evidence.ladder import Evidence
from hapticvlm.messages import (
    WHOLE,
    Decision,
    Error,
    Feel,
    Hello,
    LeftOut,
    MessageError,
    Ok,
    Party,
    ProtocolVersion,
    Region,
    Scene,
    SceneObject,
    Set,
    Shader,
    Skipped,
    Stop,
)
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.session.actions import (
    DrivePlate,
    HoldOutputs,
    PlayVibration,
    ReleaseHand,
    Reply,
    RestPlate,
)
from hapticvlm.session.frames import FrameRate
from hapticvlm.session.hands import Hand, Hold
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.targets import WHOLE_VIEW, ObjectTarget, RecognitionRequest, RequestId

LEASE_S = 0.25
NEUTRAL_HOLD_S = 30.0

PLAY = PlayVibration
WOOD = Evidence("encoder", (("wood", 0.9),))
GLASS = Evidence("encoder", (("glass", 0.9),))
METAL = Evidence("encoder", (("metal", 0.9),))


def looked(session, message, evidence, now=1.1, stages=None):
    """Send a frame, take the look it asks for, and return what its answer leads to."""
    look = only(session.receive(message, now), RecognitionRequest)[-1]
    return session.recognised(look, evidence, stages or {}, now)


PANE = SceneObject(object_id="pane", name="GlassPane")
BLOB = SceneObject(object_id="blob", name="Object_07")


def test_a_first_contact_starts_an_impact_and_is_answered_ok_before_the_decision():
    actions = owner(TABLE).receive(touch(), 1.0)
    command = only(actions, PlayVibration)[0].command
    assert (command.material, command.interaction, command.onset) == ("wood", "strike", True)
    assert command.expires_at == pytest.approx(1.0 + LEASE_S)
    messages = [action.message for action in only(actions, Reply)]
    assert isinstance(messages[0], Ok)
    assert isinstance(messages[1], Decision)
    assert (messages[1].pattern, messages[1].cached) == ("wood strike", False)


def test_a_contact_that_lapsed_on_its_way_makes_no_impact_and_is_counted():
    session = owner(TABLE)
    session.receive(touch(at=50.0), 1.0)
    session.receive(touch("release", at=51.0), 2.0)
    actions = session.receive(touch(at=51.0), 2.0 + LEASE_S + 0.01)
    assert only(actions, PlayVibration) == []
    (ok,) = replies(actions, Ok)
    assert [part.path for part in ok.left_out or []] == ["captured_at"]
    assert session.late_contacts == 1
    assert session.leases == 1
    (feel,) = only(session.receive(touch("slide", at=51.3), 2.3), PlayVibration)
    assert not feel.command.onset


def test_a_late_slide_that_begins_a_contact_rubs_without_its_impact():
    session = owner(TABLE)
    session.receive(touch(at=50.0), 1.0)
    session.receive(touch("release", at=51.0), 2.0)
    (feel,) = only(session.receive(touch(at=51.0, interaction="slide"), 3.0), PlayVibration)
    assert (feel.command.onset, session.late_contacts) == (False, 1)


def test_a_contact_within_a_lease_strikes_and_so_does_one_of_a_client_without_a_clock():
    for ats in ((50.0, 51.0, 51.0), (0.0, 0.0, 0.0)):
        session = owner(TABLE)
        session.receive(touch(at=ats[0]), 1.0)
        session.receive(touch("release", at=ats[1]), 2.0)
        later = 2.0 + (LEASE_S - 0.01 if ats[0] else 5.0)
        (feel,) = only(session.receive(touch(at=ats[2]), later), PlayVibration)
        assert (feel.command.onset, session.late_contacts) == (True, 0)


def test_further_contacts_and_slides_renew_without_another_impact():
    session = owner(TABLE)
    session.receive(touch(), 1.0)
    for phase, now in (("contact", 1.1), ("slide", 1.2)):
        (feel,) = only(session.receive(touch(phase), now), PlayVibration)
        assert not feel.command.onset
        assert feel.command.expires_at == pytest.approx(now + LEASE_S)


def test_a_decision_is_announced_once_until_its_temperature_changes():
    session = owner(TABLE)
    assert replies(session.receive(touch(), 1.0), Decision)
    assert not replies(session.receive(touch("slide"), 1.1), Decision)
    actions = session.receive(scene(replace=False, ambient_c=22.1), 1.2)
    (told,) = replies([*actions, *session.receive(touch("slide"), 1.3)], Decision)
    assert told.surface_c == 22.1


def test_a_strike_that_is_held_stays_a_strike_and_a_slide_rubs_whatever_it_is_called():
    session = owner(TABLE)
    session.receive(touch(interaction="strike"), 1.0)
    for phase, interaction in (("contact", "strike"), ("slide", "slide"), ("contact", "strike")):
        (felt,) = only(session.receive(touch(phase, interaction="strike"), 1.1), PlayVibration)
        assert (felt.command.interaction, felt.command.onset) == (interaction, False)


def test_a_slide_to_another_object_changes_the_material_without_an_impact():
    session = owner(TABLE, PANE)
    session.receive(touch(), 1.0)
    (feel,) = only(session.receive(touch("slide", "pane"), 1.1), PlayVibration)
    assert (feel.command.material, feel.command.onset) == ("glass", False)


def test_a_lapsed_lease_lets_go_and_returns_the_plate_to_neutral():
    session = owner(SceneObject(object_id="table", material="metal"), ambient_c=20.0)
    session.receive(touch(), 1.0)
    assert only(session.tick(1.02, READING), DrivePlate)
    cooled = only(session.tick(1.0 + LEASE_S, READING), DrivePlate)[0].setpoint_c
    later = session.tick(1.0 + LEASE_S + 0.02, READING)
    assert only(later, ReleaseHand)
    assert session.leases == 0
    assert only(later, DrivePlate)[0].setpoint_c > cooled
    (again,) = only(session.receive(touch(), 2.1), PlayVibration)
    assert again.command.onset


def test_a_release_ends_the_lease_at_once():
    session = owner(TABLE)
    session.receive(touch(), 1.0)
    actions = session.receive(touch("release"), 1.1)
    assert only(actions, ReleaseHand)
    assert session.leases == 0


def test_an_approach_preconditions_the_plate_but_makes_no_vibration():
    session = owner(SceneObject(object_id="table", material="metal"), ambient_c=20.0)
    assert not only(session.receive(touch("approach"), 1.0), PlayVibration)
    session.tick(1.02, READING)
    (heat,) = only(session.tick(1.2, READING), DrivePlate)
    assert heat.setpoint_c < NEUTRAL_C


def test_a_swing_needs_no_contact_and_no_target():
    actions = owner().receive(touch("approach", None, interaction="swing"), 1.0)
    assert not replies(actions, Error)
    session = owner(SceneObject(object_id="sword", material="metal"))
    (feel,) = only(
        session.receive(touch("approach", "sword", interaction="swing"), 1.0), PlayVibration
    )
    assert feel.command.interaction == "swing"


def test_an_unknown_object_feels_like_nothing():
    session = owner(BLOB)
    actions = session.receive(touch(object_id="blob"), 1.0)
    assert only(actions, PlayVibration)[0].command.material is None
    (decision,) = replies(actions, Decision)
    assert decision.material == "unknown"
    assert decision.setpoint_c == NEUTRAL_C
    assert decision.contact_c is None
    assert only(session.tick(1.02, READING), DrivePlate)[0].setpoint_c == NEUTRAL_C


def test_between_touches_the_plate_is_kept_neutral_and_then_rests():
    session = owner(SceneObject(object_id="table", material="metal"))
    session.receive(touch(), 1.0)
    session.receive(touch("release"), 1.1)
    for now in (1.2, 5.0, 1.0 + NEUTRAL_HOLD_S):
        assert only(session.tick(now, READING), DrivePlate)
    assert only(session.tick(1.1 + NEUTRAL_HOLD_S, READING), RestPlate)
    assert session.tick(1.2 + NEUTRAL_HOLD_S, READING) == []


def test_the_plate_follows_the_latest_contact_of_two_hands():
    cold = SceneObject(object_id="cold", material="metal", temperature_c=5.0)
    hot = SceneObject(object_id="hot", material="metal", temperature_c=60.0)
    session = owner(cold, hot)
    session.receive(touch(object_id="cold", hand="left"), 1.0)
    session.receive(touch(object_id="hot", hand="right"), 1.05)
    session.tick(1.06, READING)
    (heat,) = only(session.tick(1.2, READING), DrivePlate)
    assert heat.setpoint_c > NEUTRAL_C
    assert session.leases == 2


def test_a_slide_to_another_object_takes_the_cold_of_the_first_along():
    sword = SceneObject(object_id="sword", material="metal")
    hilt = SceneObject(object_id="hilt", material="wood")

    def setpoint_c(first: str) -> float:
        session, reached_c = owner(sword, hilt), NEUTRAL_C
        for step in range(50):
            now = 1.0 + 0.02 * step
            session.receive(touch("slide", first if step < 25 else "hilt"), now)
            (heat,) = only(session.tick(now, READING), DrivePlate)
            reached_c = heat.setpoint_c
        return reached_c

    assert setpoint_c("sword") < setpoint_c("hilt") - 0.5


def test_a_calibrated_contact_resistance_shapes_every_touch():
    def setpoint_c(contact_resistance: float | None) -> float:
        session = SceneSession(SessionSettings(owner=True, contact_resistance=contact_resistance))
        table = SceneObject(object_id="table", material="metal")
        session.receive(Scene(id=1, objects=[table], replace=True), 0.0)
        reached_c = NEUTRAL_C
        for step in range(100):
            now = 1.0 + 0.02 * step
            session.receive(touch("contact", "table"), now)
            (heat,) = only(session.tick(now, READING), DrivePlate)
            reached_c = heat.setpoint_c
        return reached_c

    assert setpoint_c(1e-4) < setpoint_c(None) < setpoint_c(5e-3) - 2.0


def test_another_material_under_the_hand_in_a_frame_is_another_object():
    region = Region(x=0.2, y=0.2, w=0.5, h=0.5)

    def setpoint_c(first: Evidence) -> float:
        session, reached_c = owner(), NEUTRAL_C
        for step in range(100):
            now = 1.0 + 0.02 * step
            session.receive(touch("slide", None, region=region), now)
            if step == 0 or step >= 50:
                looks = only(session.receive(frame(object_id=None), now), RecognitionRequest)
                (look,) = [one for one in looks if one.target != WHOLE_VIEW]
                session.recognised(look, first if step < 50 else WOOD, {}, now)
            (heat,) = only(session.tick(now, READING), DrivePlate)
            reached_c = heat.setpoint_c
        return reached_c

    assert setpoint_c(METAL) < setpoint_c(WOOD) - 0.5


def test_physics_outside_the_limits_is_limited_labelled_and_shown_beside():
    session = owner(SceneObject(object_id="table", material="metal", temperature_c=-20.0))
    (decision,) = replies(session.receive(touch(), 1.0), Decision)
    assert decision.setpoint_c == 18.0
    assert decision.limited_by == "setpoint"
    assert decision.unlimited_c < 0.0


def test_a_scene_at_skin_temperature_carries_no_thermal_cue():
    session = owner(TABLE, ambient_c=NEUTRAL_C)
    (decision,) = replies(session.receive(touch(), 1.0), Decision)
    assert not decision.thermal_cue


def test_a_changed_field_of_touches_is_named_once_and_one_of_scenes_each_time():
    session, changed = owner(TABLE), LeftOut(path="speed_mps", text="")
    for message, named in ((touch(), [[changed], None]), (scene(TABLE), [[changed]] * 2)):
        oks = [replies(session.receive(message, 1.0, [changed]), Ok)[0] for _ in range(2)]
        assert [ok.left_out for ok in oks] == named


def test_objects_are_declared_up_to_a_number_and_those_forgotten_make_room():
    session = owner(*(SceneObject(object_id=str(number)) for number in range(8191)))
    two = scene(SceneObject(object_id="a"), SceneObject(object_id="b"), replace=False)
    with pytest.raises(MessageError, match="8192"):
        session.receive(two, 1.0)
    assert replies(session.receive(msgspec.structs.replace(two, forget=["0"]), 1.0), Ok)


def test_a_held_speaker_leaves_the_plate_working():
    hold = Hold()
    session = SceneSession(SessionSettings(owner=True), hold)
    session.receive(scene(SceneObject(object_id="table", material="metal")), 0.0)
    hold.stop("speaker")
    assert hold.state == (("speaker", "left", False), ("speaker", "right", False))
    assert not only(session.receive(touch(), 1.0), PlayVibration)
    assert only(session.tick(1.02, READING), DrivePlate)


def test_a_held_plate_rests_while_the_hand_keeps_touching():
    hold = Hold()
    session = SceneSession(SessionSettings(owner=True), hold)
    session.receive(scene(SceneObject(object_id="table", material="metal")), 0.0)
    session.receive(touch(), 1.0)
    session.tick(1.02, READING)
    session.tick(1.04, READING)
    hold.stop("peltier")
    assert only(session.tick(1.06, READING), RestPlate)
    assert not only(session.tick(1.08, READING), DrivePlate)


def test_a_frame_of_an_object_the_scene_has_named_is_answered_at_once_and_teaches_the_scene():
    session = owner(TABLE)
    actions = session.receive(frame(object_id="table"), 1.0)
    (decision,) = replies(actions, Decision)
    assert (decision.id, decision.material, decision.source) == (5, "wood", "scene")
    (taught,) = only(actions, RecognitionRequest)
    assert (taught.reference_material, taught.target) == ("wood", ObjectTarget("table"))
    assert taught.reply_to is None
    assert session.recognised(taught, GLASS, {}, 1.1) == []


def test_some_pictures_of_an_object_are_enough_unless_one_is_sent_to_be_enrolled():
    session = owner(TABLE)
    for number in range(10):
        actions = session.receive(frame(object_id="table"), 1.0 + number)
        assert len(only(actions, RecognitionRequest)) == (number < 4)
    enrolled = session.receive(frame(object_id="table", purpose="enrol"), 20.0)
    assert only(enrolled, RecognitionRequest)[0].reference_material == "wood"


def test_what_is_taught_belongs_to_the_scene_that_taught_it():
    session = owner(TABLE, BLOB)
    (before,) = only(session.receive(frame(object_id="blob"), 1.0), RecognitionRequest)
    session.receive(scene(TABLE, BLOB), 2.0)
    (after,) = only(session.receive(frame(object_id="blob"), 3.0), RecognitionRequest)
    assert before.scene != after.scene
    assert before.reference_material is after.reference_material is None


def test_only_the_materials_that_a_scene_states_are_recognised():
    session = owner(BLOB)
    session.receive(Scene(id=7, objects=[], replace=False, materials=["glass", "metal"]), 0.5)
    seen = Evidence("encoder", (("wood", 0.5), ("glass", 0.3), ("metal", 0.1)))
    (decision,) = replies(looked(session, frame(object_id="blob"), seen), Decision)
    assert (decision.material, decision.runner_up) == ("glass", "metal")
    assert decision.confidence == pytest.approx(0.6)
    with pytest.raises(MessageError, match=r"\$\.materials\[1\]: no material `kryptonite`"):
        session.receive(
            Scene(id=8, objects=[], replace=False, materials=["wood", "kryptonite"]), 0.6
        )


HARD = Evidence("encoder", (("metal", 0.4), ("glass", 0.35), ("ceramic", 0.25)))


def test_what_is_not_sure_is_felt_as_one_material_in_full_and_the_decision_names_it():
    session = owner(BLOB)
    (decision,) = replies(looked(session, frame(object_id="blob"), HARD), Decision)
    assert (decision.material, decision.basis) == ("unknown", "least_error")
    felt = decision.felt
    assert felt in ("metal", "glass", "ceramic")
    assert decision.feels == ["smooth", "rings"]
    stated = owner(SceneObject(object_id="blob", material=felt))
    assert decision.contact_c == stated.receive(frame(object_id="blob"), 1.0)[0].message.contact_c
    (slid,) = only(session.receive(touch("slide", object_id="blob", speed_mps=0.2), 2.0), PLAY)
    assert (slid.command.material, slid.command.gain) == (felt, 1.0)


def test_a_strike_on_what_is_probably_another_material_is_weaker_and_a_rub_is_not():
    for belief, gain in ((0.45, 0.7), (0.55, 1.0)):
        session = owner(BLOB)
        seen = Evidence("encoder", (("glass", belief), ("ceramic", 0.3)))
        (decision,) = replies(looked(session, frame(object_id="blob"), seen), Decision)
        assert decision.felt == "glass"
        (struck,) = only(session.receive(touch("contact", object_id="blob"), 2.0), PLAY)
        assert (struck.command.material, struck.command.gain) == ("glass", gain)
        (rubbed,) = only(session.receive(touch("slide", object_id="blob"), 2.1), PLAY)
        assert (rubbed.command.material, rubbed.command.gain) == ("glass", 1.0)


def test_what_is_felt_does_not_flicker_with_beliefs_that_change_little():
    session = owner(BLOB)
    metal, stone = (
        Evidence("encoder", ((one, 0.45), (other, 0.4)))
        for one, other in (("metal", "stone"), ("stone", "metal"))
    )
    felt = []
    for number, seen in enumerate((metal, stone, metal, stone)):
        looked(session, frame(id=number + 5, object_id="blob"), seen, 1.0 + number)
        actions = session.receive(touch("slide", object_id="blob"), 1.5 + number)
        felt += [play.command.material for play in only(actions, PLAY)]
    assert set(felt) == {"metal"}


def graded(*objects):
    session = SceneSession(SessionSettings(owner=True, feel="graded"))
    session.receive(scene(*objects), 0.0)
    return session


def test_with_graded_feel_what_is_not_sure_is_felt_by_its_expectation_at_reduced_gain():
    session = graded(BLOB)
    (decision,) = replies(looked(session, frame(object_id="blob"), HARD), Decision)
    assert (decision.material, decision.basis) == ("unknown", "expectation")
    assert (decision.felt, decision.feels) == (None, [])
    sure = owner(SceneObject(object_id="blob", material="metal"))
    metal_c = sure.receive(frame(object_id="blob"), 1.0)[0].message.contact_c
    assert decision.contact_c is not None
    assert metal_c < decision.contact_c < NEUTRAL_C - 2.0
    (slid,) = only(session.receive(touch("slide", object_id="blob", speed_mps=0.2), 2.0), PLAY)
    assert slid.command.material in ("metal", "glass", "ceramic")
    assert slid.command.gain == 0.5


def test_with_graded_feel_a_strike_takes_more_belief_than_a_rub_to_be_felt_as_what_is_said():
    seen = Evidence("encoder", (("glass", 0.6), ("ceramic", 0.2)))
    for phase, gain in (("slide", 1.0), ("contact", 0.5)):
        session = graded(BLOB)
        (decision,) = replies(looked(session, frame(object_id="blob"), seen), Decision)
        assert (decision.material, decision.basis) == ("glass", "material")
        (felt,) = only(session.receive(touch(phase, object_id="blob"), 2.0), PLAY)
        assert felt.command.gain == gain
        (told,) = replies(looked(session, frame(object_id="blob"), seen), Decision)
        assert told.basis == ("material" if gain == 1.0 else "expectation")


def test_what_is_probably_none_of_the_materials_stays_neutral():
    session = owner(BLOB)
    seen = Evidence("encoder", (("glass", 0.2), ("ceramic", 0.1)))
    (decision,) = replies(looked(session, frame(object_id="blob"), seen), Decision)
    assert (decision.material, decision.basis, decision.contact_c) == ("unknown", "neutral", None)
    (felt,) = only(session.receive(touch("slide", object_id="blob"), 2.0), PLAY)
    assert felt.command.material is None


@pytest.mark.parametrize(
    ("beliefs", "cause"),
    [
        ((("living", 0.7), ("leather", 0.25)), "living"),
        ((("living", 0.3), ("leather", 0.2)), "living"),
        ((("leather", 0.4), ("living", 0.1)), "guess"),
        ((("leather", 0.4), ("living", 0.4)), "guess"),
        ((("leather", 0.19), ("wood", 0.18), ("stone", 0.18)), "guess"),
    ],
)
def test_what_is_alive_or_would_be_a_guess_is_not_felt_and_the_decision_says_why(beliefs, cause):
    session = owner(BLOB)
    seen = Evidence("encoder", beliefs)
    (decision,) = replies(looked(session, frame(object_id="blob"), seen), Decision)
    assert (decision.material, decision.basis, decision.felt) == ("unknown", "neutral", None)
    assert decision.neutral_because == cause
    assert decision.evidence[0].material == beliefs[0][0]
    (felt,) = only(session.receive(touch("slide", object_id="blob"), 2.0), PLAY)
    assert felt.command.material is None


def test_a_grey_surface_of_which_only_that_it_is_no_metal_is_known_is_not_felt_as_leather():
    grey = Shader(metallic=0.0, roughness=0.5, base_color=(0.5, 0.5, 0.5))
    session = owner(SceneObject(object_id="x", name="Cube.003", shader=grey))
    (decision,) = replies(session.receive(touch("contact", object_id="x"), 1.0), Decision)
    assert (decision.basis, decision.felt, decision.neutral_because) == ("neutral", None, "guess")


def test_what_the_scene_states_is_felt_as_it_is():
    for session_with in (owner, graded):
        session = session_with(SceneObject(object_id="pan", material="metal", temperature_c=90.0))
        (decision,) = replies(session.receive(frame(object_id="pan"), 1.0), Decision)
        assert (decision.basis, decision.felt) == ("material", "metal")


def test_a_frame_of_an_unsure_object_is_looked_at_and_then_decided():
    session = owner(BLOB)
    answers = looked(session, frame(object_id="blob"), WOOD, stages={"encode": 2.0})
    (decision,) = replies(answers, Decision)
    assert (decision.id, decision.material, decision.source) == (5, "wood", "encoder")
    assert decision.stages_ms == {"encode": 2.0}
    (later,) = replies(session.receive(touch(object_id="blob"), 1.2), Decision) or [decision]
    assert later.material == "wood"


def test_an_unchanged_picture_is_skipped_as_unchanged():
    session = owner(BLOB)
    (answer,) = replies(looked(session, frame(object_id="blob"), None), Skipped)
    assert answer.reason == "unchanged"


def test_a_decision_that_arrives_under_a_hand_changes_what_it_feels_without_an_impact():
    session = owner(BLOB)
    session.receive(touch(object_id="blob"), 1.0)
    session.receive(touch("slide", "blob"), 1.05)
    (feel,) = only(looked(session, frame(object_id="blob"), WOOD), PlayVibration)
    assert (feel.command.material, feel.command.onset) == ("wood", False)


def test_a_touched_region_has_the_newest_frame_looked_at():
    session = owner()
    session.receive(frame(object_id=None), 1.0)
    region = Region(x=0.2, y=0.2, w=0.5, h=0.5)
    actions = session.receive(touch(object_id=None, region=region), 1.1)
    (look,) = only(actions, RecognitionRequest)
    assert (look.reply_to, look.picture.region) == (None, region)
    assert session.is_uncached(look)
    assert replies(session.recognised(look, GLASS, {}, 1.2), Decision)[0].id == 0
    (feel,) = only(session.receive(touch("slide", None, region=region), 1.25), PlayVibration)
    assert feel.command.material == "glass"


def test_more_frames_than_the_limit_are_skipped_for_their_rate():
    session = owner(BLOB)
    answers = [session.receive(frame(id=i + 1), 1.0 + i * 0.001) for i in range(100)]
    skipped = [answer for answer in answers if replies(answer, Skipped)]
    assert len(skipped) == 10
    assert replies(skipped[0], Skipped)[0].reason == "rate"


def test_a_frame_older_than_its_own_limit_is_stale():
    session = owner(BLOB)
    session.receive(frame(at=100.0), 1.0)
    old = frame(at=100.0, max_age_ms=50.0)
    assert not session.is_stale(old, 1.04)
    assert session.is_stale(old, 1.06)


def test_an_unknown_material_names_the_nearest_and_changes_nothing():
    session = owner(TABLE)
    with pytest.raises(MessageError) as refused:
        session.receive(scene(SceneObject(object_id="x", material="wodo")), 1.0)
    assert "wood" in refused.value.text
    assert refused.value.path == "$.objects[0].material"
    assert refused.value.id == 2
    (feel,) = only(session.receive(touch(), 1.1), PlayVibration)
    assert feel.command.material == "wood"


def test_replace_forgets_the_objects_not_listed():
    session = owner(TABLE)
    session.receive(scene(PANE), 1.0)
    assert only(session.receive(touch(), 1.1), PlayVibration)[0].command.material in (None, "wood")
    (decision,) = replies(session.receive(touch("slide", "pane"), 1.2), Decision)
    assert decision.material == "glass"


def test_forget_takes_single_objects_out_and_leaves_the_others():
    session = owner(TABLE, PANE)
    assert replies(session.receive(touch("slide", "pane"), 1.0), Decision)[0].material == "glass"
    session.receive(touch("release"), 1.05)
    session.receive(scene(replace=False, forget=["pane", "never there"]), 1.1)
    assert session._model.objects.given("pane") is None
    assert session._model.objects.given("table") == TABLE
    (decision,) = replies(session.receive(touch("slide", "pane"), 1.2), Decision)
    assert decision.material == "unknown"


def test_a_recognition_of_an_object_that_was_forgotten_is_not_believed():
    session = owner(SceneObject(object_id="x"))
    (action,) = only(session.receive(frame(object_id="x"), 1.0), RecognitionRequest)
    session.receive(scene(replace=False, forget=["x"]), 1.1)
    session.receive(scene(SceneObject(object_id="x"), replace=False), 1.2)
    (answer,) = replies(session.recognised(action, WOOD, {}, 1.3), Skipped)
    assert answer.reason == "superseded"


def test_what_debris_leaves_behind_is_bounded():
    session = owner()
    for _ in range(2):
        session.receive(scene(SceneObject(object_id="again"), replace=False), 1.0)
        session.receive(scene(replace=False, forget=["again"]), 1.0)
    objects = session._model.objects
    before = objects.generation(ObjectTarget("again"))
    for number in range(100):
        shards = [f"shard {number} {index}" for index in range(100)]
        session.receive(scene(*(SceneObject(object_id=id) for id in shards), replace=False), 1.0)
        session.receive(scene(replace=False, forget=shards), 1.0)
    assert not objects.known
    assert len(objects._forgotten) <= 8192
    assert objects.generation(ObjectTarget("shard 0 0")) > 0
    assert objects.generation(ObjectTarget("again")) >= before  # no number is given twice


def test_a_new_scene_changes_what_a_touching_hand_feels():
    session = owner(TABLE)
    session.receive(touch(), 1.0)
    session.receive(touch("slide"), 1.05)
    metal = SceneObject(object_id="table", material="metal")
    actions = session.receive(scene(metal, replace=False), 1.1)
    assert only(actions, PlayVibration)[0].command.material == "metal"
    assert replies(actions, Decision)[0].material == "metal"


def test_a_shader_alone_can_decide():
    chrome = SceneObject(object_id="x", name="Cube.003", shader=Shader(metallic=1.0, roughness=0.1))
    (decision,) = replies(owner(chrome).receive(touch(object_id="x"), 1.0), Decision)
    assert (decision.material, decision.source) == ("metal", "shader")


HELLO = Hello(
    id=9,
    client=Party(name="x", version="1"),
    protocol=ProtocolVersion(major=1, minor=0),
    role="scene",
)
OWNER, GUEST = {"owner": True}, {"owner": False}
OBSERVER = {"owner": False, "observer": True}


def test_a_touch_of_an_object_in_a_region_is_of_the_object_and_keeps_its_nearest_distance():
    hand = Hand(0)
    for at, distance_m in enumerate((0.3, 0.1, 0.2)):
        hand.update(touch("approach", region=WHOLE, distance_m=distance_m), 0.1 * at)
    assert (hand.target, hand.nearest_m) == (ObjectTarget("table"), 0.1)


@each_row(
    ("who", "message", "code", "path"),
    [
        (OWNER, HELLO, "protocol", "$.type"),
        (OWNER, Set(id=3, watch=["log"]), "protocol", "$.watch"),
        (OWNER, touch(object_id=None), "message", "$.object_id"),
        (OWNER, frame(surface=1), "message", "$.surface"),
        (OWNER, frame(purpose="texture"), "message", "$.surface"),
        (GUEST, touch(), "not_owner", "$.type"),
        (GUEST, Set(id=3, feel=Feel(left="amplitude")), "not_owner", "$.feel"),
        (GUEST, Set(id=3, thermal_gain=0.5), "not_owner", "$"),
        (OBSERVER, frame(), "protocol", "$.type"),
        (OBSERVER, scene(TABLE), "protocol", "$.type"),
        (OBSERVER, Set(id=3, ambient_c=20.0), "protocol", "$.ambient_c"),
    ],
)
def test_what_a_role_may_not_say_is_refused_with_its_path(who, message, code, path):
    session = SceneSession(SessionSettings(**who))
    with pytest.raises(MessageError) as refused:
        session.receive(message, 1.0)
    error = refused.value
    assert (error.code, error.path, error.id) == (code, path, message.id)
    assert session.leases == 0


def test_a_region_that_is_not_recognised_yet_leaves_the_plate_at_neutral():
    session = owner()
    session.receive(touch(object_id=None, region=WHOLE), 1.0)
    (drive,) = only(session.tick(1.02, READING), DrivePlate)
    assert drive.setpoint_c == NEUTRAL_C


def test_thermal_gain_scales_the_deviation_from_neutral():
    session = owner(SceneObject(object_id="table", material="glass", temperature_c=23.0))
    (full,) = replies(session.receive(touch(), 1.0), Decision)
    (half,) = replies(session.receive(Set(id=3, thermal_gain=0.5), 1.1), Decision)
    assert half.unlimited_c - NEUTRAL_C == pytest.approx(0.5 * (full.unlimited_c - NEUTRAL_C))


@pytest.mark.parametrize("wrong", [touch("release", at=1e12), frame(at=1e12)])
def test_one_capture_time_from_the_far_future_costs_no_later_impact(wrong):
    session = owner(TABLE)
    session.receive(touch(at=50.0), 1.0)
    session.receive(touch("release", at=50.1), 1.1)
    session.receive(wrong, 1.1)
    session.receive(frame(at=50.2), 1.2)
    (feel,) = only(session.receive(touch(at=50.5), 1.5), PlayVibration)
    assert (feel.command.onset, session.late_contacts) == (True, 0)
    assert not session.is_stale(frame(at=50.5, max_age_ms=50.0), 1.51)


def test_a_service_clock_that_jumps_back_does_not_block_frames():
    rate = FrameRate(2)
    assert rate.admits(100.0)
    assert rate.admits(100.1)
    assert not rate.admits(100.2)
    assert rate.admits(101.0)
    assert rate.admits(50.0)


def test_a_stop_holds_each_hand_until_its_own_release_and_a_new_contact():
    hold = Hold()
    session = SceneSession(SessionSettings(owner=True), hold)
    session.receive(scene(TABLE), 0.0)
    session.receive(touch(hand="left"), 1.0)
    session.receive(touch(hand="right"), 1.0)
    assert only(session.receive(Stop(id=3, scope="all"), 1.1), HoldOutputs)
    hold.stop("all")
    session.rest()
    session.receive(touch("release", hand="left"), 1.1)
    for phase, hand in (
        ("contact", "right"),
        ("slide", "right"),
        ("approach", "right"),
        ("slide", "left"),
    ):
        with pytest.raises(MessageError, match="held by stop") as refused:
            session.receive(touch(phase, hand=hand), 1.2)
        assert refused.value.code == "unsafe"
    assert only(session.receive(touch(hand="left"), 1.3), PlayVibration)
    with pytest.raises(MessageError):
        session.receive(touch(hand="right"), 1.4)


def test_the_plate_stays_with_the_latest_contact_while_the_other_hand_renews_or_approaches():
    cold = SceneObject(object_id="cold", material="metal", temperature_c=0.0)
    hot = SceneObject(object_id="hot", material="metal", temperature_c=60.0)
    session = owner(cold, hot)
    now = 1.0
    session.receive(touch(object_id="cold", hand="left"), now)
    session.receive(touch(object_id="hot", hand="right"), now + 0.01)
    setpoints = []
    for step in range(60):
        now += 0.02
        renewing = touch("slide", "cold", hand="left") if step % 2 else touch("slide", "hot")
        session.receive(renewing, now)
        setpoints += [heat.setpoint_c for heat in only(session.tick(now, READING), DrivePlate)]
    assert setpoints == sorted(setpoints)
    session.receive(touch("release", hand="left"), now)
    session.receive(touch("approach", "cold", hand="left"), now)
    (heat,) = only(session.tick(now + 0.02, READING), DrivePlate)
    assert heat.setpoint_c >= setpoints[-1]


def test_a_setting_or_a_late_look_during_an_impact_starts_no_rubbing():
    session = owner(BLOB, TABLE)
    session.receive(touch(), 1.0)
    assert not only(session.receive(Set(id=3, ambient_c=10.0), 1.05), PlayVibration)
    session.receive(touch("slide"), 1.1)
    assert only(session.receive(Set(id=4, ambient_c=12.0), 1.15), PlayVibration)
    other = owner(BLOB)
    other.receive(touch(object_id="blob"), 1.0)
    assert not only(looked(other, frame(object_id="blob"), WOOD), PlayVibration)


def test_the_regions_of_two_hands_are_decided_apart_and_from_other_frames():
    session = owner()
    session.receive(frame(object_id=None), 1.0)
    regions = [Region(x=x, y=0.1, w=0.2, h=0.2) for x in (0.1, 0.7)]
    looks = []
    for hand, region in zip(("left", "right"), regions, strict=True):
        answers = session.receive(touch(object_id=None, region=region, hand=hand), 1.1)
        looks += only(answers, RecognitionRequest)
    assert looks[0].target != looks[1].target
    session.recognised(looks[0], WOOD, {}, 1.15)
    whole = session.receive(frame(id=9, object_id=None), 1.16)
    session.recognised(only(whole, RecognitionRequest)[-1], GLASS, {}, 1.17)
    for hand, region, expected in zip(("left", "right"), regions, ("wood", None), strict=True):
        again = touch("slide", None, region=region, hand=hand)
        (feel,) = only(session.receive(again, 1.2), PlayVibration)
        assert feel.command.material == expected


def test_a_touched_region_is_looked_at_again_in_every_newer_frame():
    session = owner()
    region = Region(x=0.2, y=0.2, w=0.5, h=0.5)
    assert not only(session.receive(touch(object_id=None, region=region), 1.0), RecognitionRequest)
    looks = only(session.receive(frame(object_id=None), 1.1), RecognitionRequest)
    assert [look.reply_to for look in looks] == [None, RequestId(5)]


def test_an_answer_for_a_scene_since_replaced_is_not_believed():
    session = owner(BLOB)
    (look,) = only(session.receive(frame(object_id="blob"), 1.0), RecognitionRequest)
    session.receive(scene(BLOB), 1.05)
    (answer,) = replies(session.recognised(look, WOOD, {}, 1.1), Skipped)
    assert answer.reason == "superseded"
    assert replies(session.receive(touch(object_id="blob"), 1.2), Decision)[0].material == "unknown"


def test_an_answer_for_the_region_of_a_contact_since_ended_is_not_believed():
    session = owner()
    session.receive(frame(object_id=None), 1.0)
    regions = [Region(x=x, y=0.1, w=0.2, h=0.2) for x in (0.1, 0.7)]
    (early,) = only(
        session.receive(touch(object_id=None, region=regions[0]), 1.1), RecognitionRequest
    )
    session.receive(touch("release"), 1.15)
    (look,) = only(
        session.receive(touch(object_id=None, region=regions[1]), 1.2), RecognitionRequest
    )
    assert session.recognised(early, METAL, {}, 1.25) == []
    session.recognised(look, WOOD, {}, 1.3)
    (feel,) = only(session.receive(touch("slide", None, region=regions[1]), 1.35), PlayVibration)
    assert feel.command.material == "wood"


def test_a_swing_ends_when_the_hand_only_approaches():
    session = owner(SceneObject(object_id="sword", material="metal"))
    session.receive(touch("approach", "sword", interaction="swing"), 1.0)
    assert only(session.receive(touch("approach", "sword"), 1.1), ReleaseHand)


def test_a_decision_says_when_the_heat_of_the_session_is_used_up():
    session = owner(SceneObject(object_id="table", material="metal", temperature_c=60.0))
    session.tick(0.5, dataclasses.replace(READING, dose_cem43=2.5))
    (decision,) = replies(session.receive(touch(), 1.0), Decision)
    assert (decision.setpoint_c, decision.limited_by) == (NEUTRAL_C, "dose")
    assert decision.unlimited_c > 40.0


def test_restating_the_same_objects_is_no_overflow_and_declared_ones_are_never_forgotten():
    many = [SceneObject(object_id=f"o{number}") for number in range(4096)]
    session = owner(*many)
    for number in range(5000):
        session.receive(touch("slide", f"undeclared{number}"), 1.0)
    session.receive(scene(*many, replace=False), 1.1)
    assert only(session.receive(touch(object_id="o0"), 1.2), PlayVibration)
    assert session._model.objects.state(ObjectTarget("o0")).facts is not None
    assert ObjectTarget("undeclared4999") in session.model.objects.known
    assert len(session.model.objects.known) == 8192


def test_live_looks_and_views_to_enrol_of_one_object_are_fused():
    session = owner(BLOB)
    for number, seen in enumerate((WOOD, WOOD, WOOD)):
        looked(session, frame(id=number + 1, object_id="blob", purpose="enrol"), seen)
    for number in range(3):
        (decision,) = replies(
            looked(session, frame(id=number + 7, object_id="blob"), GLASS), Decision
        )
        assert decision.material == "wood"
    (decision,) = replies(looked(session, frame(id=10, object_id="blob"), GLASS), Decision)
    assert (decision.material, decision.runner_up) == ("glass", None)


def test_frames_without_an_object_id_are_decided_one_by_one():
    session = owner()
    for number, seen in enumerate((WOOD, GLASS, WOOD, GLASS)):
        answers = looked(session, frame(id=number + 1, object_id=None), seen)
        (decision,) = replies(answers, Decision)
        assert decision.material == seen.material


def test_what_was_seen_of_an_object_outlives_its_being_stated_anew():
    session = owner(BLOB)
    looked(session, frame(object_id="blob"), WOOD)
    session.receive(scene(BLOB, replace=False), 1.2)
    (feel,) = only(session.receive(touch(object_id="blob"), 1.3), PlayVibration)
    assert feel.command.material == "wood"
