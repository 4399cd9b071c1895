"""A remote model against a real HTTP endpoint on loopback, honest ones and others."""

import base64
import json
import re
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import simplejpeg
from each_case import each, each_row
from serving import Reply, Request, endpoint, raw, says, sends
from word_tables import cases

from hapticvlm.backoff import OPEN_S, TRIP
from hapticvlm.vlm.contract import VlmError, VlmSettings
from hapticvlm.vlm.endpoint import read_address
from hapticvlm.vlm.limits import ANSWER_BYTES
from hapticvlm.vlm.remote import RemoteVlm, RestingError

PICTURE = np.random.default_rng(1).integers(0, 255, (90, 160, 3), dtype=np.uint8)
SOON_S = 0.5  # time limit of a question that is meant to run out
NAMES = ("wood", "glass", "fabric", "metal")
TABLES = Path(__file__).with_name("remote_cases.json")
FORMS: dict[str, Callable[..., Reply]] = {
    "says": says,
    "sends": sends,
    "bytes": lambda text: sends(text.encode("latin-1")),
    "raw": lambda text: raw(text.encode("latin-1")),
}


def replies(name: str) -> list[tuple[Reply, str]]:
    """Return the replies of a table, and what is said of each."""
    return [(FORMS[form](*given, **more), why) for form, given, more, why in cases(TABLES, name)]


class Clock:
    """Seconds that pass when a test says so."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def vlm(url: str, clock: Callable[[], float] = time.monotonic, **settings: Any) -> RemoteVlm:
    wanted = VlmSettings(url=url, timeout_s=20.0)
    return RemoteVlm(replace(wanted, **settings), clock)


def refused(reply: Reply, **settings: Any) -> str:
    """Ask an endpoint that gives such an answer; return why that is none."""
    with endpoint(reply) as served, pytest.raises(VlmError) as caught:
        vlm(served.url, **settings).ambient(PICTURE)
    return str(caught.value)


def test_a_stated_temperature_is_read_with_an_interval_that_is_our_own() -> None:
    with endpoint(says("It is about 21 °C.")) as served:
        reading = vlm(served.url).ambient(PICTURE)
    assert (reading.value_c, reading.low_c, reading.high_c) == (21.0, 13.0, 29.0)
    assert (reading.method, reading.share, reading.prompt_sd_c) == ("text", None, 0.0)
    assert reading.seconds > 0


def openai_says(parameter: str, hint: str = "") -> str:
    message = f"Unsupported parameter: '{parameter}' is not supported with this model.{hint}"
    return json.dumps({"error": {"message": message, "param": parameter, "code": "unsupported"}})


def test_parameters_that_a_new_endpoint_refuses_are_dropped_from_then_on() -> None:
    hints = {"max_tokens": " Use 'max_completion_tokens' instead."}

    def modern(sock: socket.socket, request: Request) -> None:
        refused = [n for n in ("max_tokens", "temperature") if n in request.body]
        if refused:
            error = openai_says(refused[0], hints.get(refused[0], ""))
            sends(error, "400 Bad Request")(sock, request)
        else:
            says("9")(sock, request)

    with endpoint(modern) as served:
        remote = vlm(served.url)
        assert [remote.ambient(PICTURE).value_c for _ in range(2)] == [9.0, 9.0]
        kept = [set(body) - {"model", "messages", "stream"} for body in served.questions]
    assert kept == [
        {"max_tokens", "temperature"},
        {"max_completion_tokens", "temperature"},
        *[{"max_completion_tokens"}] * 4,
    ]
    assert served.questions[-1]["max_completion_tokens"] >= 1000, "what it thinks counts, too"


@pytest.mark.parametrize("parameter", ["max_tokens", "temperature"])
def test_a_parameter_that_is_refused_again_without_it_is_an_error(parameter: str) -> None:
    stubborn = sends(openai_says(parameter), "400 Bad Request")
    with endpoint(stubborn) as served:
        with pytest.raises(VlmError, match=f"HTTP 400: Unsupported parameter: '{parameter}'"):
            vlm(served.url).ambient(PICTURE)
        assert len(served.questions) <= 3
        with_it = [parameter in body for body in served.questions]
    assert with_it == [True, *[False] * (len(with_it) - 1)]


def test_wordings_are_averaged_and_their_deviation_is_reported() -> None:
    with endpoint([says("10"), says("20")]) as served:
        reading = vlm(served.url).ambient(PICTURE)
        asked = [body["messages"][0]["content"][-1]["text"] for body in served.questions]
    assert (reading.value_c, reading.low_c, reading.high_c) == (15.0, 2.0, 28.0)
    assert reading.prompt_sd_c == pytest.approx(7.07, abs=0.01)
    assert len(set(asked)) == 2


def test_a_question_holds_one_small_jpeg_after_the_instruction() -> None:
    with endpoint(says("21")) as served:
        vlm(served.url, image_tokens=8).ambient(PICTURE)
        body = served.questions[0]
    instruction, picture, question = body["messages"][0]["content"]
    assert (instruction["type"], question["type"]) == ("text", "text")
    head, data = picture["image_url"]["url"].split(",")
    assert head == "data:image/jpeg;base64"
    shown = simplejpeg.decode_jpeg(base64.b64decode(data))
    assert shown.shape[0] * shown.shape[1] == pytest.approx(8 * 28 * 28, rel=0.05)
    assert shown.shape[1] / shown.shape[0] == pytest.approx(160 / 90, rel=0.05)
    assert (body["stream"], body["temperature"]) == (False, 0.0)


def sides(body: Any) -> list[tuple[int, int]]:
    """The height and width of each picture of a question."""
    urls = [
        part["image_url"]["url"] for part in body["messages"][0]["content"] if "image_url" in part
    ]
    return [simplejpeg.decode_jpeg(base64.b64decode(url.split(",")[1])).shape[:2] for url in urls]


@each(crop=[(28, 26), (12, 300), (1, 400), (400, 1), (1, 1)])
def test_a_small_or_long_object_is_sent_in_a_size_that_models_take(crop: tuple[int, int]) -> None:
    with endpoint(says("wood")) as served:
        vlm(served.url).material(PICTURE, np.zeros((*crop, 3), np.uint8), NAMES)
        height, width = sides(served.questions[0])[1]
    assert min(height, width) == 56
    assert max(height, width) <= 50 * 56
    assert (height > width) == (crop[0] > crop[1])


def test_refused_objects_do_not_stop_the_question_for_the_temperature() -> None:
    clock = Clock()

    def one_picture(sock: socket.socket, request: Request) -> None:
        many = len(sides(request.body)) > 1
        reply = sends("one picture only", "500 Internal Server Error") if many else says("22")
        reply(sock, request)

    with endpoint(one_picture) as served:
        remote = vlm(served.url, clock, model="some/vlm")
        for _ in range(TRIP):
            with pytest.raises(VlmError, match="one picture"):
                remote.material(PICTURE, PICTURE, NAMES)
            clock.now += 10.0
        assert remote.ambient(PICTURE).value_c == 22.0
        with pytest.raises(RestingError, match="one picture"):
            remote.material(PICTURE, PICTURE, NAMES)


def test_a_picture_within_its_budget_is_sent_as_large_as_it_is() -> None:
    with endpoint(says("21")) as served:
        vlm(served.url, image_tokens=64).ambient(PICTURE)
    assert sides(served.questions[0]) == [PICTURE.shape[:2]]


def test_the_configured_model_is_asked() -> None:
    with endpoint(says("21")) as served:
        remote = vlm(served.url, model="some/vlm")
        remote.ambient(PICTURE)
        assert [request.verb for request in served.requests] == ["POST", "POST"]
        assert served.questions[0]["model"] == "some/vlm"
    assert remote.name == f"some/vlm at {served.url.removeprefix('http://')}"


@each_row(("listed", "asked"), cases(TABLES, "models"))
def test_without_a_configured_model_the_endpoint_is_asked_for_its_own_once(
    listed: list[str] | None, asked: str
) -> None:
    with endpoint(says("21"), models=listed) as served:
        remote = vlm(served.url)
        remote.ambient(PICTURE)
        remote.ambient(PICTURE)
        assert [body["model"] for body in served.questions] == [asked] * 4
        assert len(served.requests) == 5


def test_several_models_to_choose_from_are_named() -> None:
    with endpoint(says("21"), models=["a/b", "c/d"]) as served:
        with pytest.raises(VlmError, match=r"several models.*: a/b, c/d"):
            vlm(served.url).ambient(PICTURE)
        assert served.questions == []


@each_row(("text", "beliefs"), cases(TABLES, "material"))
def test_a_material_named_in_text_is_believed_but_not_for_sure(
    text: str, beliefs: dict[str, float]
) -> None:
    with endpoint(says(text)) as served:
        assert dict(vlm(served.url).material(PICTURE, PICTURE, NAMES).beliefs) == beliefs


@each(message=cases(TABLES, "no material"))
def test_two_materials_none_denials_and_thoughts_are_not_an_answer(message: Any) -> None:
    reason = pytest.raises(VlmError, match=r"material|empty|thinks")
    with endpoint(says(None, message=message)) as served, reason:
        vlm(served.url, model="some/vlm").material(PICTURE, PICTURE, NAMES)


@each_row(
    ("reply", "why"),
    [
        *replies("unusable answer"),
        (sends("[" * 100_000), "not JSON"),
        (sends("9" * 10_000), "not JSON"),
        (sends("x" * (ANSWER_BYTES + 1)), "larger than"),
        (raw(b"HTTP/1.1 200 OK\r\n" + b"X: y\r\n" * 50_000 + b"\r\n{}"), "Receive buffer too long"),
        (raw(b"HTTP/1.1 200 OK\r\nX: " + b"y" * 200_000 + b"\r\n\r\n{}"), "buffer too long"),
    ],
)
def test_an_unusable_answer_is_refused_with_a_reason(reply: Reply, why: str) -> None:
    text = refused(reply)
    assert why in text
    assert len(text) < 400
    assert text.isprintable()


def hang(_sock: socket.socket, _request: Request) -> None:
    time.sleep(20 * SOON_S)


def dribble(sock: socket.socket, _request: Request) -> None:
    for byte in b"HTTP/1.1 200 OK\r\nContent-Length: 1000\r\n\r\n" + b" " * 1000:
        sock.sendall(bytes([byte]))
        time.sleep(SOON_S / 10)


def flood(sock: socket.socket, _request: Request) -> None:
    sock.sendall(b"HTTP/1.1 200 OK\r\n\r\n")
    for _ in range(10_000):
        sock.sendall(b"x" * 65536)


@pytest.mark.parametrize("reply", [hang, dribble])
def test_one_that_hangs_or_dribbles_is_cut_off_in_time(reply: Reply) -> None:
    started = time.monotonic()
    # What is left of the time when the request is sent is named, on a busy machine less than all.
    text = refused(reply, timeout_s=SOON_S, model="some/vlm")
    assert re.search(r"incomplete response after 0\.[0-5]\d* s", text)
    assert time.monotonic() - started < 8 * SOON_S


def test_one_time_limit_holds_for_all_wordings() -> None:
    def slow(sock: socket.socket, request: Request) -> None:
        time.sleep(0.6 * SOON_S)
        says("21")(sock, request)

    assert "incomplete response" in refused(slow, timeout_s=SOON_S, model="some/vlm")


def test_an_answer_is_read_up_to_its_limit() -> None:
    assert "larger than" in refused(flood)


def test_an_endpoint_that_is_down_is_reported() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with pytest.raises(VlmError, match="refused"):
        vlm(f"http://127.0.0.1:{port}").ambient(PICTURE)


def test_an_endpoint_without_tls_is_reported_as_such() -> None:
    with endpoint(says("21")) as served, pytest.raises(VlmError, match="SSL"):
        vlm(served.url.replace("http", "https")).ambient(PICTURE)


def test_a_redirect_is_not_followed() -> None:
    with endpoint(says("21")) as elsewhere:
        url = f"{elsewhere.url}/v1/chat/completions"
        assert "redirects" in refused(sends("", "307 Temporary Redirect", Location=url))
        assert elsewhere.requests == []


def test_a_proxy_of_the_environment_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    with endpoint(says("1")) as proxy, endpoint(says("21")) as served:
        for name in ("http_proxy", "HTTP_PROXY", "https_proxy", "ALL_PROXY"):
            monkeypatch.setenv(name, proxy.url)
        assert vlm(served.url).ambient(PICTURE).value_c == 21.0
        assert proxy.requests == []


def test_a_token_is_sent_and_never_shown() -> None:
    def echo(sock: socket.socket, request: Request) -> None:
        said = request.headers["authorization"]
        sends(json.dumps({"error": said}), "401 Unauthorized")(sock, request)

    with endpoint([says("21"), says("21"), echo]) as served:
        remote = vlm(served.url, token="s3cret")
        remote.ambient(PICTURE)
        assert served.requests[-1].headers["authorization"] == "Bearer s3cret"
        with pytest.raises(VlmError) as caught:
            remote.ambient(PICTURE)
    assert "HTTP 401: Bearer (token)" in str(caught.value)
    assert "s3cret" not in repr(vars(remote)) + repr(VlmSettings(token="s3cret"))


@pytest.mark.parametrize("token", ["", "two words", "line\r\nX-Evil: 1", "ä"])
def test_a_token_that_no_header_can_hold_is_refused_unrepeated(token: str) -> None:
    with pytest.raises(VlmError) as caught:
        vlm("http://127.0.0.1:8000", token=token)
    assert not token or token not in str(caught.value)


def test_a_token_travels_in_clear_text_to_this_machine_only() -> None:
    vlm("http://127.0.0.1:8000", token="s3cret")
    vlm("http://[::1]:8000", token="s3cret")
    vlm("https://gpu.example:8000", token="s3cret")
    with pytest.raises(VlmError, match="clear text"):
        vlm("http://gpu.example:8000", token="s3cret")


@each_row(("url", "asked"), cases(TABLES, "URL"))
def test_a_url_is_taken_as_written_and_v1_is_added_where_it_has_no_version(
    url: str, asked: str
) -> None:
    address = read_address(url)
    assert address.url == asked
    assert address.is_loopback == ("gpu" not in url)


def test_a_deployment_of_azure_is_asked_with_its_query_and_its_header() -> None:
    with endpoint(says("21")) as served:
        url = f"{served.url}/openai/deployments/eye/chat/completions?api-version=2024-10-21"
        remote = vlm(url, token="s3cret", header="api-key", model="eye")
        assert remote.ambient(PICTURE).value_c == 21.0
        request = served.requests[-1]
    assert request.path == "/openai/deployments/eye/chat/completions?api-version=2024-10-21"
    assert request.headers["api-key"] == "s3cret"
    assert "authorization" not in request.headers


@pytest.mark.parametrize("header", ["", "two words", "X:", "a\r\nb", "-x"])
def test_a_header_that_cannot_be_one_is_refused(header: str) -> None:
    with pytest.raises(VlmError, match="--vlm-header"):
        vlm("http://127.0.0.1:8000", header=header)


@each_row(("reply", "cure"), replies("cure"))
def test_what_a_user_can_do_about_an_error_is_said(reply: Reply, cure: str) -> None:
    assert cure in refused(reply, model="some/vlm")


def thinker(answer: dict[str, Any], thought: dict[str, Any]) -> Reply:
    """A model whose first tokens are its thought: few of them leave no answer."""

    def reply(sock: socket.socket, request: Request) -> None:
        has_room = request.body["max_tokens"] > 100
        message = {"role": "assistant", **(answer if has_room else thought)}
        choice = {"message": message, "finish_reason": "stop" if has_room else "length"}
        sends(json.dumps({"choices": [choice]}))(sock, request)

    return reply


@each_row(("thought", "answer"), cases(TABLES, "thought"))
def test_a_model_that_thinks_first_is_asked_again_with_room_and_then_always(
    thought: dict[str, Any], answer: dict[str, Any]
) -> None:
    with endpoint(thinker(answer, thought)) as served:
        remote = vlm(served.url, model="some/vlm")
        assert [remote.ambient(PICTURE).value_c for _ in range(2)] == [22.0, 22.0]
        tokens = [question["max_tokens"] for question in served.questions]
    assert tokens[0] < 100
    assert min(tokens[1:]) >= 1000
    assert len(tokens) == 5  # the first wording twice, the others once


def test_a_server_that_knows_no_reasoning_effort_and_does_not_say_so_is_asked_without() -> None:
    think = thinker({"content": "22"}, {"content": ""})

    def strict(sock: socket.socket, request: Request) -> None:
        unexpected = sends('{"detail": "Unexpected fields"}', "422 Unprocessable Entity")
        (unexpected if "reasoning_effort" in request.body else think)(sock, request)

    with endpoint(strict) as served:
        assert vlm(served.url, model="some/vlm").ambient(PICTURE).value_c == 22.0
        asked = ["reasoning_effort" in body for body in served.questions]
    assert asked == [False, True, False, False]


@pytest.mark.parametrize("message", [None, "22", {"content": None}])
def test_a_thought_that_leads_to_no_message_is_an_error_and_not_a_crash(message: object) -> None:
    def reply(sock: socket.socket, request: Request) -> None:
        has_room = request.body["max_tokens"] > 100
        choice = {"message": message if has_room else {"content": ""}, "finish_reason": "length"}
        sends(json.dumps({"choices": [choice]}))(sock, request)

    with endpoint(reply) as served, pytest.raises(VlmError, match=r"no text|thinks first"):
        vlm(served.url, model="some/vlm").ambient(PICTURE)


def test_a_model_that_only_thinks_is_reported_as_such() -> None:
    text = refused(says("", finish_reason="length"), model="some/vlm")
    assert "thinks first and gave no answer" in text


@each(text=cases(TABLES, "marks"))
def test_the_marks_around_an_answer_are_taken_off(text: str) -> None:
    with endpoint(says(text)) as served:
        assert vlm(served.url, model="some/vlm").ambient(PICTURE).value_c == 22.0


def test_an_answer_that_cannot_be_read_is_asked_for_once_more_and_not_repeated() -> None:
    with endpoint([says("It cannot be 30 °C."), says("12"), says("14")]) as served:
        assert vlm(served.url, model="some/vlm").ambient(PICTURE).value_c == 13.0
        asked = [body["messages"] for body in served.questions]
    assert [len(turns) for turns in asked] == [1, 1, 1]
    assert asked[1][0]["content"][-1]["text"] == "Answer with the number alone."
    assert asked[1][0]["content"][:-1] == asked[0][0]["content"]


def test_a_cut_answer_counts_only_with_its_unit() -> None:
    with endpoint(says("It is about 22 °C", finish_reason="length")) as served:
        assert vlm(served.url, model="some/vlm").ambient(PICTURE).value_c == 22.0


@each(message=cases(TABLES, "places"))
def test_an_answer_is_taken_from_where_a_server_puts_it(message: dict[str, Any]) -> None:
    with endpoint(says(None, message=message)) as served:
        assert vlm(served.url, model="some/vlm").ambient(PICTURE).value_c == 22.0


@each(url=cases(TABLES, "wrong URL"))
def test_other_urls_are_refused_before_anything_is_sent(url: str) -> None:
    with pytest.raises(VlmError, match="--vlm-url") as caught:
        vlm(url)
    assert "pw" not in str(caught.value)


def test_a_failing_endpoint_is_left_alone_then_tried_once_then_healed() -> None:
    clock = Clock()
    broken = sends("", "503 Service Unavailable", Retry_After=0)
    rests = []
    with endpoint([broken] * (TRIP + 1) + [says("21")]) as served:
        remote = vlm(served.url, clock, model="some/vlm")
        for asked in range(1, TRIP + 2):
            with pytest.raises(VlmError, match="HTTP 503"):
                remote.ambient(PICTURE)
            with pytest.raises(RestingError, match="HTTP 503") as caught:
                remote.ambient(PICTURE)
            rests.append(caught.value.seconds)
            assert len(served.questions) == asked
            clock.now += caught.value.seconds + 0.01
        assert max(rests[: TRIP - 1]) < OPEN_S <= min(rests[TRIP - 1 :])
        assert remote.ambient(PICTURE).value_c == 21.0
        assert remote.ambient(PICTURE).value_c == 21.0


def busy_until(form: str) -> Reply:
    """A reply of 40 s of patience, in one of the forms that endpoints have for it."""
    date = format_datetime(datetime.now(UTC) + timedelta(seconds=40), usegmt=True)
    delay = '{"error": {"message": "quota", "details": [{"retryDelay": "40s"}]}}'
    waits = {
        "Retry_After": date,
        "retry_after_ms": 40_000,
        "x_ratelimit_reset": int(1000 * (time.time() + 40)),
    }
    if form == "body":
        return sends(delay, "429 Too Many Requests")
    if form == "seconds":
        return sends("", "429 Too Many Requests", Retry_After=40)
    return sends("", "429 Too Many Requests", **{form: waits[form]})


@each(form=["seconds", "Retry_After", "retry_after_ms", "x_ratelimit_reset", "body"])
def test_one_that_asks_for_patience_in_any_form_is_given_it(form: str) -> None:
    clock = Clock()
    with endpoint([busy_until(form), says("21")]) as served:
        remote = vlm(served.url, clock, model="some/vlm")
        with pytest.raises(VlmError, match="HTTP 429"):
            remote.ambient(PICTURE)
        clock.now = 39.0 if form == "seconds" else 20.0
        with pytest.raises(RestingError):
            remote.ambient(PICTURE)
        clock.now = 41.0
        assert remote.ambient(PICTURE).value_c == 21.0


@pytest.mark.parametrize("wait", ["Fri, 31 Dec 1999 23:59:59 GMT", "-5", "nan", "inf", ""])
def test_an_invalid_retry_after_is_ignored(wait: str) -> None:
    clock = Clock()
    with endpoint([sends("", "429 Too Many Requests", Retry_After=wait), says("21")]) as served:
        remote = vlm(served.url, clock, model="some/vlm")
        with pytest.raises(VlmError, match="HTTP 429"):
            remote.ambient(PICTURE)
        clock.now = 1.0
        assert remote.ambient(PICTURE).value_c == 21.0


def test_a_liar_is_left_alone_like_one_that_fails() -> None:
    with endpoint(says("900")) as served:
        remote = vlm(served.url, Clock(), model="some/vlm")
        with pytest.raises(VlmError, match="outside"):
            remote.ambient(PICTURE)
        with pytest.raises(RestingError, match="outside"):
            remote.ambient(PICTURE)
        assert len(served.questions) == 2  # a wording each


def test_there_is_one_question_at_a_time_and_no_queue() -> None:
    asked, go_on = threading.Event(), threading.Event()

    def wait(sock: socket.socket, request: Request) -> None:
        asked.set()
        go_on.wait(20.0)
        says("21")(sock, request)

    with endpoint(wait) as served:
        remote = vlm(served.url, model="some/vlm")
        answers: list[float] = []
        first = threading.Thread(target=lambda: answers.append(remote.ambient(PICTURE).value_c))
        first.start()
        assert asked.wait(20.0)
        with pytest.raises(VlmError, match="busy"):
            remote.ambient(PICTURE)
        go_on.set()
        first.join(20.0)
        assert answers == [21.0]
        assert remote.ambient(PICTURE).value_c == 21.0
        assert len(served.questions) == 4


def test_nothing_is_sent_before_a_question_is_asked() -> None:
    with endpoint(says("21")) as served:
        vlm(served.url)
        assert served.requests == []
