"""Asking a shared recogniser that answers, fails in every way, and comes back."""

import time
from collections.abc import Iterator
from typing import NoReturn

import numpy as np
import pytest
from drawn_textures import frame_of, planks
from msgspec import structs
from pace import PACE
from shared_recogniser import KNOWING_NOTHING, Shared, shared_recogniser

from hapticvlm import materials
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.http_client import HttpError
from hapticvlm.messages import Frame
from hapticvlm.vision import pictures, textures
from hapticvlm.vision.frame_recogniser import FrameRecogniser
from hapticvlm.vision.pictures import Crop, central_mask
from hapticvlm.vision.recognition import SceneContext
from hapticvlm.vision.remote.client import RemoteRecogniser
from hapticvlm.vision.remote.settings import RemoteSettings

DEADLINE_S = 0.8  # wide, for a busy machine
LONG_S = 30.0  # a deadline, of which the other machine is told: 60 s at most
PATIENCE_S = 30.0 * PACE
SIDE = 224  # px, of the shipped encoder
SLACK_S = 0.2  # of a busy machine
NOTHING_S = 0.05
FAULTS = ["hangs", "closes", "garbage", "fails", "wrong hash", "dribbles"]


@pytest.fixture(scope="module")
def shared() -> Iterator[Shared]:
    with shared_recogniser() as served:
        yield served


def crop(seed: int = 0) -> Crop:
    pixels = np.random.default_rng(seed).integers(0, 255, (SIDE, SIDE, 3), np.uint8)
    return Crop(pixels, central_mask(SIDE))


def view(seed: int) -> Frame:
    """Return the same pixels as a frame."""
    return structs.replace(frame_of(crop(seed).image), purpose="live")


def remote(served: Shared, **settings: object) -> RemoteRecogniser:
    given = {"url": served.url, "deadline_s": DEADLINE_S, **settings}
    return RemoteRecogniser(RemoteSettings(**given), materials.MATERIALS)  # type: ignore[arg-type]


def tried(asked: RemoteRecogniser, *, until_used: bool = True) -> RemoteRecogniser:
    """Probe until looks are sent, or until it has failed."""
    started = time.monotonic()
    while asked.identity is None and (until_used or not asked.state.reason):
        assert time.monotonic() - started < PATIENCE_S, asked.state
        asked.probe()
        time.sleep(0.01)
    return asked


def test_the_remote_result_equals_the_local_one(shared: Shared) -> None:
    (found,) = tried(remote(shared, deadline_s=LONG_S)).recognise([crop(1)]) or ()
    embedding = shared.encoder.embed([crop(1)])[0]
    here = shared.galleries["shipped"].gallery.match(embedding)
    assert np.array_equal(found.embedding, embedding)
    assert found.evidence == here


@pytest.mark.realtime
def test_before_its_first_answer_every_crop_is_local_at_once(shared: Shared) -> None:
    asked = remote(shared)
    started = time.monotonic()
    assert asked.recognise([crop()]) is None
    assert time.monotonic() - started < NOTHING_S
    assert (asked.state.is_used, asked.state.local) == (False, 1)


@pytest.mark.realtime
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_costs_one_crop_its_share_and_the_next_ones_nothing(
    shared: Shared, fault: str
) -> None:
    asked = tried(remote(shared))
    shared.fault = fault
    try:
        started = time.monotonic()
        assert asked.recognise([crop()]) is None
        assert time.monotonic() - started < 0.75 * DEADLINE_S + SLACK_S
        for _ in range(5):
            started = time.monotonic()
            asked.probe()
            assert asked.recognise([crop()]) is None
            assert time.monotonic() - started < NOTHING_S
        assert asked.state.reason
        assert (asked.state.is_used, asked.state.local) == (False, 6)
    finally:
        shared.fault = None
    assert tried(asked).recognise([crop()]) is not None


def test_a_recogniser_that_is_gone_is_found_again_when_it_is_back() -> None:
    with shared_recogniser() as served:
        asked = tried(remote(served))
        assert asked.recognise([crop()]) is not None
        port = served.server_port
    assert asked.recognise([crop()]) is None
    assert str(port) in asked.state.reason
    with shared_recogniser(port):
        assert tried(asked).recognise([crop()]) is not None


def test_only_the_required_identity_is_used(shared: Shared) -> None:
    wanted = shared.galleries["shipped"].identity.hash
    assert tried(remote(shared, hash=wanted)).recognise([crop()]) is not None
    before = len(shared.asked)
    other = tried(remote(shared, hash="0" * 16), until_used=False)
    assert other.recognise([crop()]) is None
    assert wanted in other.state.reason
    assert len(shared.asked) == before, "no crop goes to a recogniser that is another"


def test_a_recogniser_with_unknown_materials_is_not_used(shared: Shared) -> None:
    settings = RemoteSettings(shared.url, deadline_s=DEADLINE_S)
    asked = tried(RemoteRecogniser(settings, {"wood"}), until_used=False)
    assert "does not know" in asked.state.reason
    assert "--gallery" in asked.state.reason


def test_a_token_is_sent_and_never_logged(shared: Shared) -> None:
    shared.token = "sesame-open-now"
    try:
        assert tried(remote(shared, token="sesame-open-now")).recognise([crop()]) is not None
        refused = tried(remote(shared, token="wrong-and-secret"), until_used=False)
        assert "401" in refused.state.reason
        assert "wrong-and-secret" not in repr(refused.state)
    finally:
        shared.token = None
    assert "secret" not in repr(RemoteSettings("http://127.0.0.1:1", token="secret"))


def test_a_view_of_the_whole_scene_is_never_sent(shared: Shared) -> None:
    asked = tried(remote(shared))
    recogniser = FrameRecogniser(shared.encoder, shared.galleries["shipped"].gallery, asked)
    frame = view(2)
    before = len(shared.asked)
    assert recogniser.recognise(frame, "scene", 0.0, force=True).scene_view is not None
    assert len(shared.asked) == before
    shown = SceneContext("scene", "cup")
    assert recogniser.recognise(frame, "cup", 0.0, force=True, shown=shown).evidence is not None
    assert len(shared.asked) == before + 1


class NeverLoaded:
    """The card of the shipped encoder, without the encoder."""

    def __init__(self, shared: Shared) -> None:
        self.name, self.side = shared.encoder.name, shared.encoder.side
        self.dimension = shared.encoder.dimension

    def embed(self, crops: object) -> NoReturn:
        raise AssertionError(f"this machine loads its encoder for {crops}")


def test_what_another_encoder_there_believes_is_taken_and_seen_again_when_it_comes(
    shared: Shared,
) -> None:
    shown, gallery = SceneContext("scene", "cup"), shared.galleries["shipped"].gallery
    recogniser = FrameRecogniser(
        shared.encoder, gallery, asked := remote(shared, deadline_s=LONG_S)
    )

    def look() -> Evidence | None:
        return recogniser.recognise(view(3), "cup", 0.0, force=False, shown=shown).evidence

    assert look() is not None
    tried(asked)
    recogniser._encoder = NeverLoaded(shared)
    recogniser._encoder.name = "another"
    assert look() is not None, "it was recognised here, and is there from now on"
    assert look() is None


@pytest.mark.parametrize("fault", KNOWING_NOTHING)
def test_a_crop_of_which_it_believes_nothing_is_matched_here_by_its_embedding(
    shared: Shared, fault: str
) -> None:
    gallery = shared.galleries["shipped"].gallery
    encoder = NeverLoaded(shared)
    recogniser = FrameRecogniser(encoder, gallery, asked := tried(remote(shared)))
    shared.fault = fault
    try:
        shown = SceneContext("scene", "cup")
        recognition = recogniser.recognise(view(3), "cup", 0.0, force=True, shown=shown)
        encoder.name = "another"
        with pytest.raises(AssertionError, match="loads its encoder"):
            recogniser.recognise(view(3), "cup", 0.0, force=True, shown=shown)
    finally:
        shared.fault = None
    assert recognition.evidence == gallery.match(
        shared.encoder.embed([pictures.crop(view(3), SIDE)])[0]
    )
    assert recognition.evidence.confidence > 0.0
    assert (asked.state.is_used, asked.state.answered, asked.state.local) == (True, 2, 0)


def test_the_windows_of_a_texture_map_are_embedded_there_and_read_here(shared: Shared) -> None:
    gallery = shared.galleries["shipped"].gallery
    asked = tried(remote(shared, deadline_s=LONG_S))
    before = len(shared.asked)
    there = FrameRecogniser(NeverLoaded(shared), gallery, asked).read_texture(frame_of(planks()))
    assert there == textures.read(frame_of(planks()), shared.encoder, gallery)
    assert there.confidence > 0.0
    assert len(shared.asked) == before + 1, "all windows go together"


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"url": "http://gpu.example:8791"}, "clear text"),
        ({"url": "http://gpu.example:8791", "may_be_clear": True, "token": "t"}, "use https"),
        ({"url": "ftp://gpu.example"}, "--recogniser-url"),
        ({"url": "https://user:word@gpu.example"}, "no user or password"),
    ],
)
def test_crops_and_tokens_travel_encrypted_unless_allowed(
    settings: dict[str, object], said: str
) -> None:
    with pytest.raises(HttpError, match=said):
        RemoteSettings(**settings).address()  # type: ignore[arg-type]


def test_plain_http_is_for_loopback_or_by_permission() -> None:
    assert RemoteSettings("http://127.0.0.1:8791", token="t").address().is_loopback
    assert not RemoteSettings("http://gpu:1", may_be_clear=True).address().is_encrypted
    assert RemoteSettings("https://gpu.example", token="t").address().port == 443
