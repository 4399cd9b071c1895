"""Tests the HTTP client: its deadline, its limits and its kept connection."""

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from pace import PACE
from serving import Request, endpoint, raw, sends

from hapticvlm.http_client import HttpClient, HttpError, read_address

PATIENCE_S = 20.0 * PACE
SOON_S = 0.3


@contextmanager
def client(url: str, max_bytes: int = 1000) -> Iterator[HttpClient]:
    http_client = HttpClient(read_address(url, "--url"), None, "text/plain", max_bytes)
    try:
        yield http_client
    finally:
        http_client.close()


def get(http_client: HttpClient, seconds: float = PATIENCE_S) -> bytes:
    return http_client.request("GET", "/", None, time.monotonic() + seconds).body


def test_a_connection_is_kept_between_requests() -> None:
    ports: set[int] = set()

    def answer(listener: socket.socket) -> None:
        sock, (_, port) = listener.accept()
        with sock:
            for _ in range(3):
                sock.recv(65536)
                ports.add(port)
                sock.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\nhi")

    with socket.create_server(("127.0.0.1", 0)) as listener:
        threading.Thread(target=answer, args=(listener,), daemon=True).start()
        with client(f"http://127.0.0.1:{listener.getsockname()[1]}") as http_client:
            assert [get(http_client) for _ in range(3)] == [b"hi"] * 3
    assert len(ports) == 1


def test_one_that_the_peer_ended_while_it_lay_idle_is_opened_again() -> None:
    with (
        endpoint([sends("1"), sends("2")], models=["any"]) as served,
        client(served.url) as http_client,
    ):
        for _ in range(3):
            assert get(http_client).startswith(b"{")
            time.sleep(0.05)  # the peer closes after each response


def test_a_response_may_be_as_large_as_its_limit_and_no_larger() -> None:
    for size, is_fine in ((1000, True), (1001, False)):
        with endpoint(sends("x" * size)) as served, client(served.url) as http_client:
            deadline = time.monotonic() + PATIENCE_S
            if is_fine:
                assert len(http_client.request("POST", "/", b"1", deadline).body) == size
            else:
                with pytest.raises(HttpError, match="larger than 1000 bytes"):
                    http_client.request("POST", "/", b"1", deadline)


def dribble_headers(sock: socket.socket, _request: Request) -> None:
    for number in range(3000):
        sock.sendall(f"X-{number}: y\r\n".encode() if number else b"HTTP/1.1 200 OK\r\n")
        time.sleep(SOON_S / 10)


def test_headers_that_come_one_by_one_are_cut_off_at_the_deadline() -> None:
    with endpoint(dribble_headers) as served, client(served.url) as http_client:
        started = time.monotonic()
        with pytest.raises(HttpError, match=r"incomplete response after 0\.[0-3] s"):
            http_client.request("POST", "/", b"1", started + SOON_S)
        assert time.monotonic() - started < 30 * SOON_S


def test_after_a_request_that_was_cut_off_the_next_one_gets_its_own_response() -> None:
    def late(sock: socket.socket, _request: Request) -> None:
        time.sleep(2 * SOON_S)
        sends("late")(sock, _request)

    with endpoint([late, sends("soon")]) as served, client(served.url) as http_client:
        with pytest.raises(HttpError, match="incomplete"):
            http_client.request("POST", "/", b"1", time.monotonic() + SOON_S)
        time.sleep(2 * SOON_S)
        assert http_client.request("POST", "/", b"1", time.monotonic() + PATIENCE_S).body == b"soon"


def test_a_deadline_that_has_passed_sends_nothing() -> None:
    with endpoint(raw(b"")) as served, client(served.url) as http_client:
        with pytest.raises(HttpError, match="incomplete response after 0 s"):
            http_client.request("POST", "/", b"1", time.monotonic() - 1.0)
        assert served.requests == []
