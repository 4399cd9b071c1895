"""Ownership of the outputs: scenes that change, wait, take over, and return after a pause."""

import contextlib
import threading

import msgpack
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.sync.server import serve

pytest_plugins = ("mono_build",)


def test_a_scene_that_waits_takes_the_outputs_when_they_are_free_and_is_felt(play):
    output = play("Owners.Handover")
    assert "waiting: owner False touches sent 0 silent because another scene owns" in output
    assert "felt as wood" in output
    assert "log: HapticVLM: this scene owns the outputs now and is felt." in output


def test_outputs_that_become_free_right_after_the_welcome_are_taken(play, service):
    hello = {"type": "hello", "role": "observer", "client": {"name": "test", "version": "1"}}
    with connect(service.url, compression=None) as socket:
        socket.send(msgpack.packb({**hello, "id": 1, "protocol": {"major": 1, "minor": 1}}))
        welcome = msgpack.unpackb(socket.recv())
    assert welcome["type"] == "welcome"

    def answer(socket):
        with contextlib.suppress(ConnectionClosed):
            for message in map(msgpack.unpackb, socket):
                if message["type"] != "hello":
                    socket.send(msgpack.packb({"type": "ok", "id": message["id"]}))
                    continue
                free = {"type": "ownership", "id": 0, "owner": False, "free": True}
                owned = {**welcome, "id": message["id"], "owner": False}
                for message in (owned, free):
                    socket.send(msgpack.packb(message))

    with serve(answer, "127.0.0.1", 0, compression=None) as server:
        port = server.socket.getsockname()[1]
        threading.Thread(target=server.serve_forever, daemon=True).start()
        output = play("Owners.SceneChanges", f"ws://127.0.0.1:{port}/")
        server.shutdown()
    assert "scenes 100 owned 100" in output


def test_of_two_clients_in_one_process_the_first_connects_and_the_second_takes_over(play):
    output = play("Owners.TwoClients")
    assert "first active True second Closed: the Haptic Client 'client' connects for all" in output
    assert "then second active True" in output
    assert "then none True" in output


def test_a_client_that_is_kept_between_scenes_connects_for_all_without_a_warning(play):
    assert "kept True of next True Closed warnings 0" in play("Owners.Kept")


def test_after_the_headset_was_taken_off_and_on_pictures_are_shown_again(play):
    assert "shown before True and after True" in play("Owners.HeadsetOff")


def test_a_stop_of_an_earlier_session_does_not_make_the_first_touch_unfelt(play):
    assert "touches True refused 0" in play("Owners.Stopped")


def test_a_scan_in_the_editor_never_owns_the_outputs_and_ends_when_the_scene_plays(play):
    output = play("Owners.PlayDuringScan")
    assert "felt beside the scan True" in output
    assert "scan ended True" in output
    assert "felt while it plays" in output
