"""The request of a connection: what it means, and what is refused in words."""

import asyncio

import pytest
from asked import asked
from each_case import each_row
from edge_service import Service, listening
from hypothesis import given
from hypothesis import strategies as st
from pace import PACE
from websockets.asyncio.client import connect

from hapticvlm.server.edge.request import RequestError, RequestReader, refusal

MAX_REQUEST_BYTES = 32 * 1024

HOST = b"Host: 127.0.0.1\r\n"
UPGRADE = b"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
UPGRADE += b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"


def get(target=b"/", *headers, method=b"GET"):
    return method + b" " + target + b" HTTP/1.1\r\n" + HOST + b"".join(headers) + b"\r\n"


def read(data):
    complete = RequestReader(MAX_REQUEST_BYTES).feed(data)
    assert complete is not None
    return complete[0]


def status_of(data):
    try:
        read(data)
    except RequestError as error:
        return error.status
    return 200


@each_row(
    ("data", "status"),
    [
        (get(), 200),
        (get(b"/", b"Connection: keep-alive\r\n", b"Connection: x\r\n"), 200),  # a list header
        (get(b"/a[1].png?b=//c"), 200),
        (get(b"http://127.0.0.1/x"), 200),
        (get(method=b"HEAD"), 200),
        (get(b"/", b"Cookie: " + b"c" * 9_000 + b"\r\n"), 200),  # those of all servers of a host
        (get(b"/", b"Content-Length: 0\r\n"), 200),
        (get(b"/", b"X: 1\r\n" * 127), 200),
        (get(b"/", b"X: 1\r\n" * 128), 431),
        (get(b"http://["), 400),
        (get(b"//[x]/"), 400),
        (get(b"*"), 400),
        (get(b"/", b"Sec-Fetch-Site: none\r\n" * 2), 400),
        (get(b"/", b"Sec-Fetch-Mode: cors\r\n" * 2), 400),
        (get(b"/", b"Origin: null\r\n" * 2), 400),
        (b"GET / HTTP/1.1\r\n\r\n", 400),
        (b"GET / HTTP/1.1\nHost: 127.0.0.1\n\n", 400),
        (get(b"/", b"a: b\r\n c\r\n"), 400),  # a folded line
        (get(b"/", b"a : b\r\n"), 400),
        (get(b"/", b"a: \x00\r\n"), 400),
        (get(b"/", b"Content-Length: 5\r\n"), 400),
        (get(b"/", b"Transfer-Encoding: chunked\r\n"), 400),
        (b"GET /\xc3\xa4 HTTP/1.1\r\n" + HOST + b"\r\n", 400),
        (b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 400),
        (b"\x16\x03\x01\x02\x00\x01", 400),  # TLS on a port that is not encrypted
        (get(method=b"POST"), 405),
        (get(method=b"OPTIONS"), 405),
        (get(b"*", method=b"OPTIONS"), 405),
        (get(method=b"TRACE"), 405),
        (get(b"127.0.0.1:80", method=b"CONNECT"), 405),
        (b"GET /" + b"a" * 8192, 414),
        (get(b"/", b"Cookie: " + b"c" * MAX_REQUEST_BYTES + b"\r\n"), 431),
        (b"GET / HTTP/1.1\r\nCookie: " + b"c" * MAX_REQUEST_BYTES, 431),  # before it ends
    ],
)
def test_a_request_is_read_or_refused_in_words(data, status):
    assert status_of(data) == status


@each_row(
    ("data", "status", "text"),
    [
        (b"GET  / HTTP/1.1\r\n\r\n", 400, "the first line is not `METHOD target HTTP/1.1`"),
        (b"GET / HTTP/3\r\n\r\n", 400, "the version is not HTTP/1.1"),
        (get(b"//["), 400, "the target is not a path that starts with one slash"),
        (get(b"/", b"a\r\n"), 400, "a header is not `Name: value` on one line"),
        (get(b"/", b"a: b\r\n" * 200), 431, "the request has more than 128 headers"),
        (get(b"/", HOST), 400, "the request has more than one Host header"),
    ],
)
def test_a_refusal_says_what_was_wrong_and_is_not_kept(data, status, text):
    with pytest.raises(RequestError) as refused:
        read(data)
    answer = refusal(refused.value)
    assert (answer.status_code, answer.body) == (status, f"{text}\n".encode())
    assert dict(answer.headers.raw_items()) == {
        "Content-Type": "text/plain; charset=utf-8",
        "Content-Length": str(len(text) + 1),
        "Connection": "close",
        "X-Content-Type-Options": "nosniff",
        "Cache-Control": "no-store",
    }


@given(st.lists(st.integers(1, 120), max_size=20))
def test_a_request_means_the_same_wherever_it_is_cut(cuts):
    data = get(b"/try?x", b"Origin: http://a\r\n", UPGRADE) + b"\x89\x80"
    reader, at = RequestReader(MAX_REQUEST_BYTES), 0
    complete, rest = None, b""
    for cut in [*cuts, len(data)]:
        piece, at = data[at : at + cut], at + cut
        if complete is not None:
            rest += piece
        elif (found := reader.feed(piece)) is not None:
            complete, rest = found
    assert complete is not None
    assert (complete.path, complete.origin, complete.is_upgrade) == ("/try", "http://a", True)
    assert rest == b"\x89\x80"


@pytest.mark.parametrize(
    ("headers", "is_upgrade"),
    [
        ([("Connection", "Upgrade"), ("Upgrade", "websocket")], True),
        ([("Connection", "keep-alive, Upgrade"), ("Upgrade", "WebSocket")], True),
        ([("Connection", "keep-alive"), ("Connection", "upgrade"), ("Upgrade", "websocket")], True),
        ([("Connection", "Upgrade, HTTP2-Settings"), ("Upgrade", "h2c")], False),  # curl --http2
        ([("Connection", "no-upgrade"), ("Upgrade", "websocket")], False),
        ([("Upgrade", "websocket")], False),
    ],
)
def test_a_websocket_is_asked_for_by_both_headers(headers, is_upgrade):
    assert asked("/", *headers).is_upgrade == is_upgrade


def test_a_target_that_names_a_host_takes_the_place_of_the_host_header():
    request = asked("http://evil.example:80/x?y")
    assert (request.host, request.path) == ("evil.example:80", "/x")


async def test_a_websocket_with_two_connection_lines_opens():
    two = [("Connection", "keep-alive")]
    async with (
        listening(Service(lambda data: data)) as port,
        connect(f"ws://127.0.0.1:{port}/", additional_headers=two, proxy=None) as client,
    ):
        await client.send(b"touch")
        async with asyncio.timeout(5 * PACE):
            assert await client.recv() == b"touch"
