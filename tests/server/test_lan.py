"""`serve --lan`: opens the service to phones, with a token that it makes and keeps."""

import re
import stat
import sys
from pathlib import Path

import numpy as np
import pytest
import qr_codes

from hapticvlm.commands.run_service import print_ready
from hapticvlm.errors import UsageError
from hapticvlm.messages import Device, Devices
from hapticvlm.server import service_info
from hapticvlm.server.access import Address
from hapticvlm.server.settings import ServeOptions
from hapticvlm.server.web import lan, lan_pages

DEVICES = Devices(speaker=Device("simulated", True), peltier=Device("simulated", True))
PIXELS = 6  # of a half of a character


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path


def read_code(text: str) -> str:
    """The picture that a camera reads off a terminal with light letters on dark."""
    rows = [
        line for line in text.splitlines() if line and not set(line) - set(" \u2580\u2584\u2588")
    ]
    halves = []
    for row in rows:
        halves.append([letter in "\u2580\u2588" for letter in row])
        halves.append([letter in "\u2584\u2588" for letter in row])
    picture = np.kron(np.array(halves, np.uint8) * 255, np.ones((PIXELS, PIXELS), np.uint8))
    return qr_codes.read_code(picture)


def test_the_token_is_kept_for_the_next_time_and_only_its_owner_may_read_it() -> None:
    token = lan.opened(ServeOptions(lan=True)).token
    assert token == lan.opened(ServeOptions(lan=True)).token
    if sys.platform != "win32":
        assert stat.S_IMODE(lan.token_file().stat().st_mode) == 0o600
    lan.token_file().write_text("twelve chars\n")
    assert lan.kept_token() == "twelve chars"


@pytest.mark.parametrize("damaged", [b"", b"11 letters.\n", b"\xff\xfe" * 20, b"x" * 10_000])
def test_a_damaged_token_is_made_anew(damaged: bytes) -> None:
    lan.token_file().parent.mkdir(parents=True)
    lan.token_file().write_bytes(damaged)
    made = lan.kept_token()
    assert re.fullmatch(r"[a-z0-9]{4}(-[a-z0-9]{4}){2}", made)
    assert lan.kept_token() == made


def test_a_home_that_cannot_be_written_is_told_with_what_was_to_be_kept(tmp_path, monkeypatch):
    (tmp_path / "home").write_text("a file")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    with pytest.raises(UsageError, match=r"token cannot be kept in .*lan-token.*HAPTICVLM_TOKEN"):
        lan.kept_token()


def test_what_it_makes_is_accepted_off_this_machine() -> None:
    options = lan.opened(ServeOptions(lan=True))
    address = service_info.address(options)
    assert (address.host, address.pages_from) == ("0.0.0.0", "lan")
    tokens = {lan.new_token() for _ in range(100)}
    assert len(tokens) == 100
    assert {len(token) for token in tokens} == {14}  # three groups of four letters
    assert set("".join(tokens)) == set("-abcdefghjkmnpqrstuvwxyz23456789")


def test_what_the_user_states_stays() -> None:
    stated = ServeOptions(lan=True, host="192.168.7.7", token="a token of my own")
    options = lan.opened(stated)
    assert (options.host, options.token) == ("192.168.7.7", "a token of my own")
    assert not lan.token_file().exists()


@pytest.mark.parametrize("token", [None, "SECRET"])
def test_a_refused_token_is_answered_with_one_that_would_do(token: str | None) -> None:
    with pytest.raises(ValueError, match=r"--token [a-z0-9-]{14}") as refused:
        Address("0.0.0.0", token=token)
    offered = re.search(r"--token ([a-z0-9-]{14})", str(refused.value))
    assert offered is not None
    assert Address("0.0.0.0", token=offered.group(1)).token == offered.group(1)


@pytest.mark.parametrize("is_terminal", [True, False])
def test_links_are_printed_and_to_a_terminal_alone_the_token_and_its_code(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    *,
    is_terminal: bool,
) -> None:
    (tmp_path / "index.html").write_text("<!doctype html>")
    options = lan.opened(ServeOptions(lan=True, scene=tmp_path))
    monkeypatch.setattr(sys.stdout, "isatty", lambda: is_terminal)
    print_ready(options, 8790, DEVICES, has_priority=False)
    shown = capsys.readouterr().out
    assert str(lan.token_file()) in shown
    assert "to hear it: --speaker default" in shown
    if not is_terminal:
        assert str(options.token) not in shown
        assert "\u2588" not in shown
        return
    host = lan_pages.own_address() or "0.0.0.0"
    assert f"http://{host}:8790/scene/" in shown
    assert f"password: {options.token}" in shown
    link = f"http://phone:{options.token}@{host}:8790/try"
    assert f" {link}\n" in shown
    assert read_code(shown) == link


def test_a_folder_that_has_nothing_for_its_option_is_named(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    options = ServeOptions(scene=tmp_path, gallery=tmp_path)
    for is_empty in (True, False):
        print_ready(options, 8790, DEVICES, has_priority=False)
        shown = capsys.readouterr().out
        assert [f"{name} {tmp_path}" in shown for name in ("--scene", "--gallery")] == [
            is_empty
        ] * 2
        for name in ("index.html", "walnut.toml"):
            (tmp_path / name).touch()


def test_a_token_with_any_letters_is_read_from_the_link() -> None:
    link = lan.phone_link("http://10.0.0.2:8790/", "a b/c@d:e")
    assert link == "http://phone:a%20b%2Fc%40d%3Ae@10.0.0.2:8790/try"
