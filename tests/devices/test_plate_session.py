"""Tests the host's half of the plate protocol without a port: bytes and time are arguments."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hapticvlm.devices import faults
from hapticvlm.devices.plate import protocol as plate_protocol
from hapticvlm.devices.plate.framing import Deframer
from hapticvlm.devices.plate.protocol import (
    Ack,
    Answer,
    Clear,
    Hello,
    HelloReply,
    Off,
    Rest,
    Setpoint,
    State,
)
from hapticvlm.devices.plate.requests import Orders
from hapticvlm.devices.plate.session import Dose, PlateSession

ACK_TIMEOUT_S = 0.15
HELLO_S = 0.25
REOPEN_AFTER_S = 3.0
RX_TIMEOUT_S = 0.5

FIRMWARE = Path(__file__).parents[2] / "firmware"
BOARD = HelloReply(1, 0, 1, 2, 3, 7, 18_000, 40_000, 5000, 1000, 750, 2000, 250, 667, 20, 1)
TOLD = plate_protocol.Telemetry(5000, 1, 0, 25_125, 25_200, 23_500, 25_000, -333, 0, 0, 0, 0, 0, 1)
TURN_S = 0.02


def said(session: PlateSession, now: float) -> list[plate_protocol.Message]:
    """Return the messages that the session writes now."""
    return [plate_protocol.decode(frame) for frame in Deframer().feed(session.outgoing(now))]


def tell(session: PlateSession, message: plate_protocol.Message, now: float) -> None:
    session.receive(plate_protocol.encode(message, 0), now)


def telemetry(uptime_s: float, **changes: Any) -> plate_protocol.Telemetry:
    return dataclasses.replace(TOLD, uptime_ms=round(uptime_s * 1000), **changes)


def greeted(now: float = 0.0) -> PlateSession:
    """A session with a board that has answered and sent telemetry."""
    session = PlateSession()
    session.opened(now)
    assert said(session, now) == [Hello(1, 3)]
    tell(session, BOARD, now)
    tell(session, telemetry(5.0 + now), now)
    return session


def commanded(
    session: PlateSession, begin_s: float, seconds: float, booted_s: float = -5.0
) -> list[plate_protocol.Message]:
    """Command 22 degC at 50 Hz while telemetry arrives; return every message written."""
    written = []
    for tick in range(round(seconds / TURN_S)):
        now = begin_s + tick * TURN_S
        session.command(22.0, 0.25, now)
        written += said(session, now)
        if session.is_ready:
            tell(session, telemetry(now - booted_s), now)
    return written


def test_nothing_is_commanded_before_the_board_has_answered() -> None:
    session = PlateSession()
    session.opened(0.0)
    session.command(22.0, 1.0, 0.0)

    assert said(session, 0.0) == [Hello(1, 3)]
    assert said(session, HELLO_S / 2) == []
    assert said(session, HELLO_S) == [Hello(1, 3)]
    assert not session.is_ready
    assert session.counts["commands_ignored"] == 1


@pytest.mark.parametrize(("major", "cure"), [(0, "flash the firmware"), (2, "upgrade")])
def test_another_major_is_refused_naming_both_and_the_cure(major: int, cure: str) -> None:
    session = PlateSession()
    session.opened(0.0)
    tell(session, dataclasses.replace(BOARD, major=major, minor=4), 0.0)
    session.command(22.0, 1.0, 0.1)

    assert session.refusal is not None
    for part in (f"{major}.4", "1.3", cure):
        assert part in session.refusal
    assert not session.is_ready
    assert said(session, 0.2) == []
    assert session.reading(0.2).faults == ("plate_version",)


def test_a_board_whose_clock_is_wrong_is_named_switched_off_and_driven_no_more() -> None:
    session, written = greeted(), list[plate_protocol.Message]()
    for tick in range(3000):
        now = tick * TURN_S
        session.command(22.0, 0.25, now)
        written += said(session, now)
        tell(session, telemetry(5.0 + 1.1 * now), now)
    assert session.reading(now).faults == ("plate_clock_wrong",)
    drives = [message for message in written if isinstance(message, Setpoint | Off)]
    begun = drives.index(Off())
    assert begun > 0
    assert set(drives[begun:]) == {Off()}


def test_a_newer_minor_is_accepted() -> None:
    session = PlateSession()
    session.opened(0.0)
    tell(session, dataclasses.replace(BOARD, minor=9), 0.0)

    assert session.is_ready
    assert session.refusal is None


def test_a_setpoint_is_sent_with_what_is_left_of_its_lease_and_never_after() -> None:
    session = greeted()
    session.command(22.0, 0.25, 1.0)
    sent = [(now, said(session, now)) for now in (1.0, 1.05, 1.1, 1.21, 1.24, 1.26, 5.0)]

    assert sent == [
        (1.0, [Setpoint(22_000, 250)]),
        (1.05, []),
        (1.1, [Setpoint(22_000, 150)]),
        (1.21, [Setpoint(22_000, 40)]),
        (1.24, []),
        (1.26, []),
        (5.0, []),
    ]


def test_a_changing_setpoint_is_sent_at_most_25_times_a_second() -> None:
    session = greeted()
    sent = []
    for tick in range(100):
        now = 1.0 + tick * 0.01
        session.command(22.0 + tick * 0.01, 0.25, now)
        sent += said(session, now)

    assert 20 <= len(sent) <= 26
    assert all(isinstance(message, Setpoint) for message in sent)


@pytest.mark.parametrize(
    ("told_c", "sent_mc"), [(5.0, 18_000), (60.0, 40_000), (math.nan, 32_000), (math.inf, 32_000)]
)
def test_the_host_limits_what_it_sends(told_c: float, sent_mc: int) -> None:
    session = greeted()
    session.command(told_c, 5.0, 1.0)

    assert said(session, 1.0) == [Setpoint(sent_mc, 1000)]


@pytest.mark.parametrize("ttl_s", [0.0, -1.0, math.nan, math.inf])
def test_a_command_without_a_sane_time_to_live_is_not_sent(ttl_s: float) -> None:
    session = greeted()
    session.command(22.0, ttl_s, 1.0)

    assert said(session, 1.0) == []


def test_a_reading_says_what_the_board_told() -> None:
    reading = greeted().reading(0.1)

    assert (reading.plate_c, reading.sink_c, reading.setpoint_c) == (25.125, 23.5, 25.0)
    assert reading.duty == pytest.approx(-333 / 667)
    assert not reading.current_limited
    assert reading.faults == ()


def test_no_reading_stays_none() -> None:
    session = greeted()
    tell(session, telemetry(5.1, plate_mc=None, sink_mc=None, setpoint_mc=None), 0.1)
    reading = session.reading(0.1)

    assert reading.plate_c is None
    assert reading.sink_c is None
    assert reading.setpoint_c == 32.0


def test_a_board_that_falls_silent_has_no_reading_and_is_a_fault() -> None:
    session = greeted()

    session.receive(b"", RX_TIMEOUT_S)
    assert session.reading(RX_TIMEOUT_S).plate_c is not None
    session.receive(b"", RX_TIMEOUT_S + 0.01)
    silent = session.reading(RX_TIMEOUT_S + 0.01)
    assert silent.plate_c is None
    assert silent.faults == ("plate_silent",)
    assert not session.is_gone(REOPEN_AFTER_S)
    assert session.is_gone(REOPEN_AFTER_S + 0.01)


def test_a_board_that_nobody_could_listen_to_is_not_called_silent() -> None:
    session = greeted()

    assert session.reading(RX_TIMEOUT_S * 3).faults == ()
    assert session.reading(2.0 + 0.01).faults == ("plate_silent",)


def test_a_lost_port_is_a_fault_and_sends_nothing() -> None:
    session = greeted()
    commanded(session, 0.0, 1.0)
    session.lost()

    assert (session.board, session.is_moving) == (None, False)
    assert session.reading(1.1).faults == ("plate_unplugged",)
    assert session.reading(1.1).plate_c is None
    assert session.reading(1.1).duty == 0.0
    assert said(session, 1.1) == []
    assert session.counts["losses"] == 1


def reopened(session: PlateSession, now: float) -> None:
    """Open the port again, which resets the board: its uptime starts from zero."""
    session.opened(now)
    assert said(session, now) == [Hello(1, 3)]
    tell(session, telemetry(0.1), now)
    tell(session, BOARD, now)


def test_after_a_reconnect_a_caller_that_just_goes_on_drives_nothing() -> None:
    session = greeted()
    assert commanded(session, 0.0, 1.0)
    session.lost()
    assert commanded(session, 1.0, 1.0) == []
    reopened(session, 2.0)

    assert commanded(session, 2.0, 20.0) == []
    assert session.counts["reconnects"] == 1
    assert session.counts["commands_ignored"] >= 1000


def test_after_a_reconnect_a_command_after_a_pause_is_obeyed() -> None:
    session = greeted()
    commanded(session, 0.0, 1.0)
    session.lost()
    reopened(session, 1.4)
    assert commanded(session, 1.42, 0.5) == []

    assert commanded(session, 3.0, 1.0)[0] == Setpoint(22_000, 250)


def test_after_a_reconnect_a_command_after_a_rest_is_obeyed() -> None:
    session = greeted()
    commanded(session, 0.0, 1.0)
    session.lost()
    reopened(session, 1.0)
    session.rest()

    assert Setpoint(22_000, 250) in commanded(session, 1.02, 0.1)


def test_a_rest_while_unplugged_does_not_let_the_same_caller_drive_on() -> None:
    session = greeted()
    commanded(session, 0.0, 1.0)
    session.lost()
    session.rest()
    assert commanded(session, 1.0, 0.4) == []
    reopened(session, 1.4)

    assert commanded(session, 1.4, 1.0) == []


def test_a_command_that_a_fault_keeps_from_effect_takes_back_no_rest() -> None:
    session = greeted()
    commanded(session, 0.0, 1.0)
    tell(session, telemetry(6.0, faults=1 << 13, state=3), 1.0)
    session.rest()
    written = said(session, 1.0)
    session.command(22.0, 0.25, 1.02)
    written += said(session, 1.01 + ACK_TIMEOUT_S)
    assert written == [plate_protocol.Rest()] * 2  # the first had no answer


def test_a_reset_board_is_greeted_again_and_not_driven_on() -> None:
    session = greeted()
    commanded(session, 0.0, 1.0)
    tell(session, telemetry(0.05), 1.0)

    assert said(session, 1.02) == [Hello(1, 3)]
    tell(session, BOARD, 1.02)
    later = []
    for tick in range(100):
        now = 1.04 + tick * TURN_S
        session.command(22.0, 0.25, now)
        later += said(session, now)
        tell(session, telemetry(now), now)
    assert later == []
    assert session.counts.get("board_resets") == 1


def test_a_board_that_asks_for_a_hello_gets_one() -> None:
    session = greeted()
    tell(session, Ack(0x02, 5, Answer.NEEDS_HELLO), 0.1)

    assert said(session, 0.1) == [Hello(1, 3)]
    assert session.counts["refused"] == 1


def test_the_uptime_may_wrap() -> None:
    session = greeted()
    tell(session, telemetry(2**32 / 1000 - 0.01), 0.1)
    # That far ahead at once counts as back: begin again from there.
    before = session.counts["board_resets"]
    tell(session, BOARD, 0.1)
    tell(session, telemetry(0.04), 0.15)

    assert session.counts["board_resets"] == before


def test_a_latched_fault_is_named_and_ends_the_lease() -> None:
    session = greeted()
    commanded(session, 0.0, 1.0)
    tell(session, telemetry(6.0, faults=1 << 10 | 1 << 31, state=3), 1.0)
    session.command(22.0, 0.25, 1.0)

    assert session.reading(1.0).faults == ("over_temperature", "fault_31")
    assert said(session, 1.2) == []
    session.command(22.0, 0.25, 3.0)  # after a pause, as a new caller
    assert said(session, 3.0) == []


def test_a_cleared_fault_does_not_let_the_same_caller_drive_on() -> None:
    session = greeted()
    commanded(session, 0.0, 1.0)
    for tick in range(50):
        now = 1.0 + tick * TURN_S
        session.command(22.0, 0.25, now)
        tell(session, telemetry(5.0 + now, faults=1 << 13, state=3), now)
    assert commanded(session, 2.0, 2.0) == []

    assert commanded(session, 5.0, 1.0)


def test_an_order_is_repeated_until_it_is_acknowledged() -> None:
    session = greeted()
    session.rest()
    first = Deframer().feed(session.outgoing(1.0))[0]
    assert said(session, 1.0 + ACK_TIMEOUT_S / 2) == []
    again = Deframer().feed(session.outgoing(1.01 + ACK_TIMEOUT_S))[0]
    assert first == again
    assert plate_protocol.decode(first) == Rest()
    tell(session, Ack(0x04, first.seq, Answer.OK), 1.3)

    assert said(session, 2.0) == []
    assert session.answer is Answer.OK


def test_the_frames_are_numbered_modulo_256() -> None:
    orders = Orders()
    sent = Deframer().feed(b"".join(orders.encode(Off()) for _ in range(257)))
    assert [frame.seq for frame in sent] == [*range(1, 256), 0, 1]


def test_an_order_that_never_arrives_is_given_up_and_counted() -> None:
    session = greeted()
    session.off()
    sent = [message for n in range(100) for message in said(session, 1.0 + n * ACK_TIMEOUT_S)]

    assert sent == [Off()] * 5
    assert session.counts["orders_lost"] == 1
    assert not session.is_busy


def test_the_repetition_of_a_rest_does_not_undo_a_newer_command() -> None:
    session = greeted()
    session.rest()
    assert said(session, 1.0) == [Rest()]
    session.command(22.0, 0.25, 1.1)

    assert said(session, 1.2) == [Setpoint(22_000, 150)]


def test_an_acknowledgement_of_another_frame_does_not_end_an_order() -> None:
    session = greeted()
    session.clear(13)
    (sent,) = Deframer().feed(session.outgoing(1.0))
    tell(session, Ack(0x05, sent.seq + 1, Answer.OK), 1.0)
    tell(session, Ack(0x04, sent.seq, Answer.OK), 1.0)

    assert plate_protocol.decode(sent) == Clear(13)
    assert session.is_busy


@given(st.lists(st.binary(max_size=120), max_size=30))
def test_no_bytes_raise_and_the_conversation_goes_on(noise: list[bytes]) -> None:
    session = greeted()
    for number, part in enumerate(noise):
        session.receive(part, number * 0.01)
        session.outgoing(number * 0.01)
        session.reading(number * 0.01)
    session.receive(b"\0", 0.4)
    tell(session, telemetry(6.0, plate_mc=31_000), 0.4)

    assert session.reading(0.4).plate_c == 31.0


@example(0x83, b"\x00\x00\x04")  # an answer that the board wants a hello
@given(st.sampled_from([*range(1, 6), 0x81, 0x83, 9]), st.binary(max_size=48))
def test_any_frame_past_its_crc_is_taken_or_counted(kind: int, payload: bytes) -> None:
    from hapticvlm.devices.plate.framing import Frame, frame

    session = greeted()
    session.receive(frame(Frame(kind, 3, payload)), 0.1)
    session.outgoing(0.1)

    # A board that says it wants a hello has restarted: what it measured before is forgotten.
    wants_hello = session.counts.get("board_resets") == 1
    assert wants_hello or session.reading(0.1).plate_c is not None


def test_the_dose_survives_a_board_that_forgets_and_ends_with_a_rest() -> None:
    dose = Dose()
    dose.update(1.5, 400.0, 0.0)
    dose.restart()
    dose.update(0.0, 0.0, 1.0)
    dose.update(0.25, 10.0, 20.0)
    assert dose.total == (1.75, 410.0)
    dose.update(0.25, 10.0, 20.0 + 900.0)

    assert dose.total == (0.25, 10.0)


@pytest.mark.parametrize("is_opened", [False, True], ids=["by-itself", "by-opening-the-port"])
def test_the_dose_that_a_board_reported_survives_its_reset(is_opened: bool) -> None:
    session = greeted()
    tell(session, telemetry(6.0, dose_mcem43=1500, heated_s=400), 1.0)
    if is_opened:
        session.lost()
        session.opened(2.0)
    tell(session, telemetry(0.1, dose_mcem43=0, heated_s=0), 2.0)
    tell(session, telemetry(20.1, dose_mcem43=250, heated_s=10), 22.0)

    reading = session.reading(22.0)
    assert (reading.dose_cem43, reading.heated_s) == (1.75, 410.0)


def test_the_dose_of_a_board_that_remembers_is_not_counted_twice() -> None:
    dose = Dose()
    dose.update(1.5, 400.0, 0.0)
    dose.restart()
    dose.update(1.5, 400.0, 1.0)

    assert dose.total == (1.5, 400.0)


def test_the_faults_are_those_of_the_firmware() -> None:
    header = (FIRMWARE / "core" / "protocol.h").read_text(encoding="utf-8")
    body = header.split("enum Fault", 1)[1].split("}", 1)[0]
    stated = {int(n): name.lower() for name, n in re.findall(r"(\w+) = (\d+)", body)}
    stated.pop(max(stated))

    assert {number: fault.name for number, fault in faults.FIRMWARE.items()} == stated


def test_a_fault_is_told_in_words() -> None:
    assert faults.describe("runaway") == (
        "driven hard for 1 s, the plate did not follow (runaway, number 13): "
        "check whether its thermistor came off, the module is broken or its supply is missing"
    )
    assert faults.describe("fault_31") == "fault_31"
    assert "plug it in again" in faults.describe("plate_unplugged")


@pytest.mark.parametrize("named", ["runaway", "RUNAWAY", "13"])
def test_a_fault_is_found_by_name_or_number(named: str) -> None:
    assert faults.number_of(named) == 13


def test_an_unknown_fault_is_answered_with_those_there_are() -> None:
    with pytest.raises(ValueError, match="no fault 'warm'; there are 1 plate_a_open, "):
        faults.number_of("warm")


def test_a_rest_after_a_stop_does_not_undo_an_off_that_is_not_answered_yet():
    session = greeted()
    session.command(30.0, 0.25, 0.0)
    session.off()
    session.rest()
    assert said(session, 1.0) == [Off()]


def test_a_board_that_follows_no_setpoint_for_a_second_is_a_fault_until_it_holds():
    session = greeted()
    now, name = 0.0, faults.NOT_FOLLOWED.name
    reports = []
    for turn in range(120):
        now = turn * 0.05
        session.command(25.0, 0.25, now)
        session.outgoing(now)  # which noise on the line destroys
        state = State.OFF if now < 3.0 else State.HOLDING
        tell(session, telemetry(5.0 + now, state=state, setpoint_mc=None), now)
        reports.append((now, name in session.reading(now).faults))
    first = next(now for now, is_reported in reports if is_reported)
    assert 0.5 < first <= 1.0
    assert all(is_reported == (first <= now < 3.0) for now, is_reported in reports)


def test_a_board_that_was_told_nothing_is_not_said_to_follow_nothing():
    session = greeted()
    for turn in range(60):
        tell(session, telemetry(5.0 + turn * 0.05, state=State.OFF), turn * 0.05)
        assert session.reading(turn * 0.05).faults == ()
