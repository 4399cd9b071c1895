"""Sessions under messages, looks, answers and times in any order: what must hold whatever comes."""

import dataclasses
import math

import numpy as np
import simplejpeg
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from hapticvlm.evidence.ambient import SceneView
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.messages import (
    ClientMessage,
    Frame,
    HandName,
    Hello,
    MessageError,
    Party,
    ProtocolVersion,
    Region,
    Scene,
    SceneObject,
    Scope,
    Set,
    Shader,
    Stop,
    Touch,
    encode,
)
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.limits import AT_REST, PlateReading
from hapticvlm.session.actions import (
    Action,
    AskAmbient,
    AskMaterial,
    DrivePlate,
    HoldOutputs,
    PlayVibration,
    ReleaseHand,
    Reply,
    RestPlate,
    SetGain,
)
from hapticvlm.session.hands import NAMES, OUTPUTS, Hold
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.targets import SURROUNDINGS, RecognitionRequest, RequestId

SETPOINT_MAX_C = 40.0
SETPOINT_MIN_C = 18.0
LEASE_S = 0.25

TICK_S = 0.02
STALL_S = 0.1  # s, the longest pause between ticks that may earn slew
PIXEL = simplejpeg.encode_jpeg(np.full((8, 8, 3), 90, np.uint8))
IDS = ("table", "GlassPane", "Object_07", "kettle", "")
MATERIALS = ("wood", "metal", "glass", "unknown", "wodo", None)

ids = st.integers(1, 2**53 - 1)
object_ids = st.sampled_from(IDS).map(lambda name: name or None)
clocks = st.one_of(st.floats(-1e12, 1e12), st.floats(0.0, 60.0))
shares = st.floats(0.0, 1.0)
sides = st.floats(1e-300, 1.0)
regions = st.none() | st.builds(Region, x=shares, y=shares, w=sides, h=sides)
celsius = st.none() | st.floats(-100.0, 400.0)
shaders = st.none() | st.builds(
    Shader,
    metallic=st.none() | shares,
    roughness=st.none() | shares,
    transmission=st.none() | shares,
    opacity=st.none() | shares,
    base_color=st.none() | st.tuples(shares, shares, shares),
)
stated = st.builds(
    SceneObject,
    object_id=st.sampled_from(IDS[:-1]),
    name=st.none() | st.sampled_from(("Oak_Table", "Ice_Cube", "steel door on", "")),
    material=st.sampled_from(MATERIALS),
    temperature_c=celsius,
    shader=shaders,
    thickness_m=st.none() | st.floats(5e-324, 10.0),
    sunlit=st.none() | st.booleans(),
)
touches = st.builds(
    Touch,
    id=ids,
    phase=st.sampled_from(("approach", "contact", "slide", "release")),
    captured_at=clocks,
    hand=st.sampled_from(NAMES),
    speed_mps=st.floats(0.0, 20.0),
    force_n=st.floats(0.0, 200.0),
    object_id=object_ids,
    region=regions,
    interaction=st.sampled_from((None, "tap", "strike", "press", "slide", "carve", "swing")),
)
frames = st.builds(
    Frame,
    id=ids,
    captured_at=clocks,
    format=st.just("jpeg"),
    width=st.sampled_from((8, 8, 8, 9)),
    height=st.just(8),
    image=st.just(PIXEL),
    origin=st.sampled_from(("top", "bottom")),
    purpose=st.sampled_from(("live", "enrol")),
    object_id=object_ids,
    region=regions,
    max_age_ms=st.none() | st.floats(0.0, 60_000.0),
)
scenes = st.builds(
    Scene,
    id=ids,
    objects=st.lists(stated, max_size=4),
    replace=st.booleans(),
    ambient_c=st.none() | st.floats(-60.0, 80.0),
)
sets = st.builds(
    Set,
    id=ids,
    ambient_c=st.none() | st.floats(-60.0, 80.0),
    vibration_gain=st.none() | shares,
    thermal_gain=st.none() | shares,
    watch=st.none() | st.just(["frames", "log"]),
)
stops = st.builds(Stop, id=ids, scope=st.sampled_from(("all", "speaker", "peltier")))
hellos = st.builds(
    Hello,
    id=ids,
    client=st.just(Party(name="x", version="1")),
    protocol=st.just(ProtocolVersion(major=1, minor=0)),
    role=st.sampled_from(("scene", "observer")),
)
readings = st.builds(
    dataclasses.replace,
    st.just(AT_REST),
    plate_c=st.none() | st.floats(-40.0, 120.0),
    sink_c=st.none() | st.floats(-40.0, 120.0),
    dose_cem43=st.floats(0.0, 5.0),
    heated_s=st.floats(0.0, 2000.0),
    current_limited=st.booleans(),
)
evidence = st.none() | st.builds(
    lambda material, share: Evidence("encoder", ((material, share),)),
    st.sampled_from(("wood", "metal", "glass")),
    shares,
)
sights = st.none() | st.integers(0, 5).map(
    lambda number: SceneView(np.eye(6, dtype=np.float32)[number], number / 6.0)
)
answers = st.none() | st.floats(-60.0, 80.0).map(
    lambda value_c: Reading(value_c, value_c - 2.0, value_c + 2.0, None, "readout", 0.9)
)


class Scenes(RuleBasedStateMachine):
    """A service's sessions and a shell that does with their actions what the gateway does."""

    @initialize()
    def begin(self) -> None:
        self.now = 1000.0
        self.hold = Hold()
        self.reading = AT_REST
        self.owner = SceneSession(SessionSettings(owner=True, can_ask=True), self.hold)
        self.other = SceneSession(SessionSettings(owner=False, can_ask=True), self.hold)
        self.watcher = SceneSession(SessionSettings(owner=False, observer=True), self.hold)
        self.looks: list[tuple[SceneSession, RecognitionRequest]] = []
        self.asks: list[tuple[SceneSession, AskAmbient | AskMaterial]] = []
        self.voices: dict[int, float] = {}
        self.stopped: set[tuple[str, str]] = set()  # until that hand was released
        self.setpoint_c: float | None = None
        self.elapsed_s = 0.0
        self.touched_at = -math.inf
        self.ticked_at: float | None = None

    def session(self, who: str) -> SceneSession:
        return {"owner": self.owner, "other": self.other, "watcher": self.watcher}[who]

    @rule(message=touches)
    def owner_touches(self, message: Touch) -> None:
        if self.send(self.owner, message) and message.phase != "release":
            self.touched_at = self.now

    @rule(hand=st.sampled_from(NAMES), objects=st.sampled_from(IDS[:-1]), count=st.integers(1, 5))
    def owner_holds_on(self, hand: HandName, objects: str, count: int) -> None:
        """Touch as a sane client does, long enough for the plate to move."""
        still = Touch(
            id=1,
            phase="slide",
            captured_at=self.now,
            hand=hand,
            object_id=objects,
            speed_mps=0.2,
            force_n=1.0,
        )
        for _ in range(count):
            if self.send(self.owner, still):
                self.touched_at = self.now
            self.pass_time(TICK_S, self.reading)

    @rule(
        who=st.sampled_from(("owner", "other", "watcher")),
        message=st.one_of(frames, frames, scenes, sets, stops, hellos),
    )
    def anyone_sends(self, who: str, message: Frame | Scene | Set | Stop | Hello) -> None:
        self.send(self.session(who), message)

    @rule(who=st.sampled_from(("other", "watcher")), message=touches)
    def others_touch_in_vain(self, who: str, message: Touch) -> None:
        assert not self.send(self.session(who), message)

    @precondition(lambda self: self.looks)
    @rule(which=st.integers(0, 50), seen=evidence, sight=sights, late_s=st.floats(0.0, 0.5))
    def recogniser_answers(
        self, which: int, seen: Evidence | None, sight: SceneView | None, late_s: float
    ) -> None:
        session, look = self.looks.pop(which % len(self.looks))
        self.now += late_s
        if look.target == SURROUNDINGS:
            actions = session.scene_view_received(look, sight, self.now)
        else:
            actions = session.recognised(look, seen, {"encode": 1.0}, self.now)
        self.carry_out(session, actions, 0 if look.reply_to is None else look.reply_to.value)

    @precondition(lambda self: self.asks)
    @rule(which=st.integers(0, 50), answer=answers, seen=evidence)
    def vlm_answers(self, which: int, answer: Reading | None, seen: Evidence | None) -> None:
        session, ask = self.asks.pop(which % len(self.asks))
        what = answer if isinstance(ask, AskAmbient) else seen
        self.carry_out(session, session.answered(ask, what, self.now), 0)

    @rule(reading=readings)
    def tick(self, reading: PlateReading) -> None:
        self.pass_time(TICK_S, reading)

    @rule(elapsed_s=st.sampled_from((0.0, 0.24, 0.26, 1.0, 29.0, 31.0, 1e4)), reading=readings)
    def the_machine_sleeps(self, elapsed_s: float, reading: PlateReading) -> None:
        self.pass_time(elapsed_s, reading)

    @rule()
    def the_owner_leaves_and_another_comes(self) -> None:
        self.owner.rest()
        self.rest()
        self.looks = [(who, look) for who, look in self.looks if who is not self.owner]
        self.asks = [(who, ask) for who, ask in self.asks if who is not self.owner]
        self.touched_at, self.ticked_at = -math.inf, None
        self.owner = SceneSession(
            SessionSettings(owner=True, reading=self.reading, can_ask=True), self.hold
        )

    @invariant()
    def a_voice_that_sounds_is_of_a_hand_with_a_lease(self) -> None:
        if not hasattr(self, "voices"):
            return
        sounding = [hand for hand, until in self.voices.items() if until > self.now]
        assert len(sounding) <= self.owner.leases
        assert not self.other.leases
        assert not self.watcher.leases

    @invariant()
    def what_waits_is_bounded(self) -> None:
        del getattr(self, "looks", [])[:-20]
        del getattr(self, "asks", [])[:-20]

    def send(self, session: SceneSession, message: ClientMessage) -> bool:
        """Send a message; return whether it was taken. It is answered once, now or by a look."""
        refusal = None
        try:
            actions = session.receive(message, self.now)
        except MessageError as error:
            refusal = error
        if refusal is not None:
            assert (refusal.id, bool(refusal.text)) == (message.id, True)
            return False
        if isinstance(message, Touch) and message.phase == "release":
            self.stopped -= {(output, message.hand) for output in OUTPUTS}
        later = [action for action in only(actions, RecognitionRequest) if action.reply_to]
        assert all(action.reply_to == RequestId(message.id) for action in later)
        self.carry_out(session, actions, 0 if later else message.id, may_answer=not later)
        assert len(later) <= 1
        return True

    def carry_out(
        self, session: SceneSession, actions: list[Action], id: int, *, may_answer: bool = True
    ) -> None:
        told = [action.message for action in only(actions, Reply)]
        for message in told:
            assert "NaN" not in str(message)
            assert "null" not in str(encode(message, as_text=True)).replace('"contact_c":null', "")
        assert [message.id for message in told if message.id] == ([id] if id and may_answer else [])
        for action in actions:
            self.do(session, action)

    def do(self, session: SceneSession, action: Action) -> None:
        match action:
            case RecognitionRequest():
                self.looks.append((session, action))
            case AskAmbient() | AskMaterial():
                self.asks.append((session, action))
            case HoldOutputs(scope):
                self.stop(scope)
            case PlayVibration() | ReleaseHand() | SetGain() | DrivePlate() | RestPlate():
                assert session is self.owner
                self.drive(action)

    def drive(self, action: Action) -> None:
        match action:
            case PlayVibration(command):
                assert command.expires_at <= self.now + LEASE_S
                assert ("speaker", NAMES[command.hand]) not in self.stopped
                self.voices[command.hand] = command.expires_at
            case ReleaseHand(hand):
                self.voices.pop(hand, None)
            case SetGain(gain):
                assert 0.0 <= gain <= 1.0
            case DrivePlate(setpoint_c, ttl_s):
                self.heat(setpoint_c, ttl_s)
            case RestPlate():
                self.setpoint_c = None

    def heat(self, setpoint_c: float, ttl_s: float) -> None:
        assert ttl_s <= LEASE_S
        assert SETPOINT_MIN_C <= setpoint_c <= SETPOINT_MAX_C
        assert not self.stopped.issuperset(("peltier", hand) for hand in NAMES)
        reach_c = 12.0 * min(self.elapsed_s, STALL_S) + 1e-9
        if self.setpoint_c is not None:
            assert abs(setpoint_c - self.setpoint_c) <= reach_c
            if not self.owner.leases:
                before_c = abs(self.setpoint_c - NEUTRAL_C)
                assert abs(setpoint_c - NEUTRAL_C) <= before_c + 1e-9
        elif self.reading.plate_c is not None:
            plate_c = min(max(self.reading.plate_c, SETPOINT_MIN_C), SETPOINT_MAX_C)
            assert abs(setpoint_c - plate_c) <= reach_c
        self.setpoint_c = setpoint_c

    def pass_time(self, elapsed_s: float, reading: PlateReading) -> None:
        self.now += elapsed_s
        self.elapsed_s = 0.0 if self.ticked_at is None else self.now - self.ticked_at
        self.ticked_at, self.reading = self.now, reading
        actions = self.owner.tick(self.now, reading)
        assert not only(actions, Reply)
        self.carry_out(self.owner, actions, 0)
        if not self.owner.leases and self.now - self.touched_at > 30.0:
            assert self.setpoint_c is None

    def stop(self, scope: Scope) -> None:
        self.hold.stop(scope)
        outputs = OUTPUTS if scope == "all" else (scope,)
        self.stopped |= {(output, hand) for output in outputs for hand in NAMES}
        if scope != "peltier":
            self.voices.clear()
        if scope != "speaker":
            self.setpoint_c = None
        if scope == "all":
            self.owner.rest()

    def rest(self) -> None:
        self.voices.clear()
        self.setpoint_c = None


def only(actions, kind):
    return [action for action in actions if isinstance(action, kind)]


Scenes.TestCase.settings = settings(
    max_examples=30,
    stateful_step_count=40,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=list(HealthCheck),
)
TestScenes = Scenes.TestCase
