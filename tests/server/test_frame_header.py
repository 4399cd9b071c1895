"""What a frame claims is compared with its own headers before its session sees it."""

import io

import pytest
from PIL import Image

from hapticvlm.messages import Frame, MessageError
from hapticvlm.server.websocket import require_header


def frame(**fields):
    buffer = io.BytesIO()
    Image.new("RGB", (32, 32)).save(buffer, "PNG")
    given = {"format": "png", "width": 32, "height": 32, "origin": "top"}
    return Frame(id=7, captured_at=1.0, **{**given, "image": buffer.getvalue(), **fields})


def test_a_frame_that_is_what_it_claims_passes():
    require_header(frame())


@pytest.mark.parametrize(
    ("wrong", "path"),
    [({"format": "jpeg"}, "$.image"), ({"width": 64}, "$.image"), ({"image": b""}, "$.image")],
)
def test_a_frame_that_is_not_what_it_claims_is_refused_by_its_field_and_id(wrong, path):
    with pytest.raises(MessageError) as refused:
        require_header(frame(**wrong))
    assert (refused.value.path, refused.value.id) == (path, 7)
