"""One frame to evidence: decode, embed, match; pictures seen before are remembered.

Runs in the recogniser process, and wherever pictures are recognised without a service. Knows no
process and no session.
"""

from __future__ import annotations

import hashlib
import time
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import msgspec
import numpy as np
from numpy.typing import NDArray

from hapticvlm.evidence.ambient import SceneView
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.messages import Frame, Region
from hapticvlm.vision import pictures
from hapticvlm.vision.encoders.encoder import Encoder, EncoderError
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.pictures import PictureError
from hapticvlm.vision.scene_references import SceneReferences

if TYPE_CHECKING:
    from hapticvlm.vision.remote.client import RemoteRecogniser
    from hapticvlm.vision.remote.contract import RemoteMatch

MAX_REMEMBERED = 1024
MAX_SCENES = 16  # whose named objects teach; the one unused longest makes room


@dataclass(frozen=True, slots=True)
class Recognition:
    """The result for one frame: evidence, None for an unchanged picture, or an error.

    `scene_view` is the embedding and brightness of what was recognised, whatever it shows.
    """

    evidence: Evidence | None
    stages_ms: dict[str, float]
    scene_view: SceneView | None = None
    error: str | None = None
    error_path: str | None = None
    is_our_fault: bool = False


@dataclass(frozen=True, slots=True)
class SceneContext:
    """What a frame shows: an object of a scene, and its material where that is sure."""

    scene: str
    object_id: str | None
    material: str | None = None


@dataclass(slots=True)
class _LastPicture:
    """The signature of the picture that was last recognised, and the digest of the last seen."""

    signature: NDArray[np.float32]
    digest: bytes


class FrameRecogniser:
    """Recognises pictures one after the other; remembers the last picture of each object."""

    def __init__(
        self, encoder: Encoder, gallery: Gallery, remote: RemoteRecogniser | None = None
    ) -> None:
        self._encoder = encoder
        self._gallery = gallery
        self._remote = remote
        self._answered_by = ""  # the identity of the shared recogniser, "" = this machine
        self._scenes: OrderedDict[str, SceneReferences] = OrderedDict()
        self._remembered: OrderedDict[str, _LastPicture] = OrderedDict()

    def warm_up(self) -> None:
        """Recognise a grey picture, since the first one is slow. Raises EncoderError."""
        import simplejpeg

        side = 2 * self._encoder.side
        grey = simplejpeg.encode_jpeg(np.full((side, side, 3), 127, np.uint8))
        frame = Frame(
            id=1, captured_at=0.0, format="jpeg", width=side, height=side, image=grey, origin="top"
        )
        found = self.recognise(msgspec.msgpack.encode(frame), "", 0.0, force=True)
        if found.error is not None:
            raise EncoderError(found.error)
        self._remembered.clear()

    def compare(self, frame: Frame, regions: Sequence[Region | None]) -> list[Evidence]:
        """Match several regions of a frame (None = its centre, or all its mask), embedded together.

        Raises PictureError and EncoderError.
        """
        crops = pictures.crops(frame, regions, self._encoder.side)
        return [self._gallery.match(embedding) for embedding in self._encoder.embed(crops)]

    def recognise(
        self,
        data: bytes,
        subject: str,
        waited_ms: float,
        *,
        force: bool,
        shown: SceneContext | None = None,
    ) -> Recognition:
        """Decode, compare with the last picture of the same object, embed and match.

        An object that is `shown` with its material teaches its scene, another one is taught by it.
        What is `shown` may be recognised elsewhere; a whole scene, shown by None, never is.
        """
        stages = {"queue": waited_ms}
        started = time.perf_counter()
        frame = msgspec.msgpack.decode(data, type=Frame)
        if self._remote is not None:
            self._follow(self._remote)
        # A scene sends what it renders, up to 90 times a second, and most of it shows what was
        # shown before. The very same bytes need not even be decoded. Comparing a few cells of two
        # pictures costs next to nothing beside embedding them. `anew` is set where the same picture
        # may mean something else: what the scene can be made of has changed, or it is to teach.
        may_skip = frame.purpose == "live" and not force
        digest = _digest(frame)
        if may_skip and self._is_the_same(subject, digest):
            return Recognition(None, stages)
        try:
            crop = pictures.crop(frame, self._encoder.side)
        except PictureError as error:
            return Recognition(None, stages, error=str(error), error_path=error.path)
        stages["decode"], _ = _lap(started)
        if self._is_unchanged(subject, crop, digest) and may_skip:
            return Recognition(None, stages)
        return self._match(frame, crop, shown, stages)

    def _match(
        self,
        frame: Frame,
        crop: pictures.Crop,
        shown: SceneContext | None,
        stages: dict[str, float],
    ) -> Recognition:
        """Embed a crop, here or elsewhere, and match it; adds to `stages`."""
        started = time.perf_counter()
        found = None
        if self._remote is not None and shown is not None:
            found = self._ask_remote(self._remote, frame, crop)
            stages["remote"], started = _lap(started)
        if found is not None:
            evidence = found.evidence
            embedding = found.embedding
        else:
            try:
                embedding = self._encoder.embed([crop])[0]
            except EncoderError as error:
                return Recognition(None, stages, error=str(error), is_our_fault=True)
            stages["encode"], started = _lap(started)
            evidence = self._gallery.match(embedding)
        if shown is not None:
            evidence = self._with_scene_references(evidence, embedding, shown)
        stages["match"], _ = _lap(started)
        return Recognition(evidence, stages, SceneView(embedding, float(crop.image.mean()) / 255.0))

    def _follow(self, remote: RemoteRecogniser) -> None:
        """Recognise every object anew when another encoder or gallery answers from now on."""
        remote.probe()
        answering = "" if remote.identity is None else remote.identity.hash
        # Two encoders do not agree on what is near what. When the shared recogniser comes or goes,
        # all pictures count as changed, so that each object is decided once more by whoever answers
        # now, and no decision is a mixture. References that were taught stay apart by the same name
        # (`_with_scene_references`).
        if answering != self._answered_by:
            self._answered_by = answering
            self._remembered.clear()

    def _ask_remote(
        self, remote: RemoteRecogniser, frame: Frame, crop: pictures.Crop
    ) -> RemoteMatch | None:
        identity = remote.identity
        if identity is not None and identity.side != self._encoder.side:
            # The picture is cut once more from the frame, and not the crop enlarged: the other
            # encoder may want more pixels than this one kept.
            crop = pictures.crop(frame, identity.side)
        found = remote.recognise(crop)
        if found is None:
            self._answered_by = ""
        return found

    def _with_scene_references(
        self, evidence: Evidence, embedding: NDArray[np.float32], shown: SceneContext
    ) -> Evidence:
        scene = f"{self._answered_by} {shown.scene}"  # embeddings of two encoders do not compare
        references = self._scenes.pop(scene, None) or SceneReferences()
        self._scenes[scene] = references
        if len(self._scenes) > MAX_SCENES:
            self._scenes.popitem(last=False)
        if shown.material is not None and shown.object_id is not None:
            references.add(shown.object_id, shown.material, embedding)
            return evidence
        return references.adjust(evidence, embedding, shown.object_id)

    def _is_the_same(self, subject: str, digest: bytes) -> bool:
        """Whether these bytes were the last that this subject showed."""
        before = self._remembered.get(subject)
        return before is not None and before.digest == digest

    def _is_unchanged(self, subject: str, crop: pictures.Crop, digest: bytes) -> bool:
        signature = pictures.signature(crop)
        before = self._remembered.get(subject)
        if before is not None and not pictures.has_changed(before.signature, signature):
            before.digest = digest
            return True
        self._remembered[subject] = _LastPicture(signature, digest)
        # The newest of MAX_REMEMBERED subjects are kept. A client names them, so without a bound it
        # could fill the memory; one that is forgotten is recognised once more and nothing else.
        self._remembered.move_to_end(subject)
        if len(self._remembered) > MAX_REMEMBERED:
            self._remembered.popitem(last=False)
        return False


def _digest(frame: Frame) -> bytes:
    """Return 16 bytes that differ when anything of what is looked at differs."""
    digest = hashlib.blake2b(frame.image, digest_size=16)
    shape = (frame.format, frame.width, frame.height, frame.origin, frame.region)
    digest.update(repr(shape).encode())
    digest.update(frame.mask or b"")
    return digest.digest()


def _lap(started: float) -> tuple[float, float]:
    now = time.perf_counter()
    return (now - started) * 1000.0, now
