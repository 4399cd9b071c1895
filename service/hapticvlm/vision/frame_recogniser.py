"""Recognises frames: decodes, embeds, matches a gallery, and skips pictures that did not change.

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

import numpy as np
from numpy.typing import NDArray

from hapticvlm.evidence.ambient import SceneView
from hapticvlm.evidence.ladder import Evidence, ranked
from hapticvlm.messages import Frame, Region
from hapticvlm.vision import pictures, texture_verdicts, textures, tones
from hapticvlm.vision.encoders import living
from hapticvlm.vision.encoders.encoder import Encoder, EncoderError
from hapticvlm.vision.flatness import is_flat
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.pictures import PictureError
from hapticvlm.vision.recognition import Recognition, SceneContext
from hapticvlm.vision.scene_references import SceneReferences
from hapticvlm.vision.texture_verdicts import TextureVerdicts

if TYPE_CHECKING:
    from hapticvlm.vision.remote.client import RemoteRecogniser
    from hapticvlm.vision.remote.contract import RemoteMatch

MAX_LAST_PICTURES = 1024
# Of the beliefs in a crop without an outline. A region shows what lies around the thing, too, so it
# is read worse than a thing alone. The largest at which, of spots on photographs, at most 7 % get a
# wrong word and 77 % of the words are right (LOG.md of the training).
SPOT_EXPONENT = 0.77
MAX_TAUGHT_SCENES = 16  # whose named objects give references; the least recently used is dropped


@dataclass(slots=True)
class _LastPicture:
    """Signature of the last recognised picture of a subject, and digest of its last frame."""

    signature: NDArray[np.float32]
    digest: bytes


class FrameRecogniser:
    """Recognises pictures one after the other; remembers the last picture of each object."""

    def __init__(
        self,
        encoder: Encoder,
        gallery: Gallery,
        remote: RemoteRecogniser | None = None,
        verdicts: TextureVerdicts | None = None,
    ) -> None:
        self._verdicts = verdicts or TextureVerdicts(None)
        self._encoder = encoder
        self._gallery = gallery
        self._remote = remote
        self._answered_by = ""  # the identity of the shared recogniser, "" = this machine
        self._scenes: OrderedDict[str, SceneReferences] = OrderedDict()
        self._last_pictures: OrderedDict[str, _LastPicture] = OrderedDict()

    def warm_up(self) -> None:
        """Recognise a grey picture, since the first one is slow. Raises EncoderError."""
        import simplejpeg

        side = 2 * self._encoder.side
        grey = simplejpeg.encode_jpeg(np.full((side, side, 3), 127, np.uint8))
        frame = Frame(
            id=1, captured_at=0.0, format="jpeg", width=side, height=side, image=grey, origin="top"
        )
        recognition = self.recognise(frame, "", 0.0, force=True)
        if recognition.error is not None:
            raise EncoderError(recognition.error)
        self._last_pictures.clear()

    def compare(self, frame: Frame, regions: Sequence[Region | None]) -> list[Evidence]:
        """Match several regions of a frame, embedded together; None is its centre or all its mask.

        Raises PictureError and EncoderError.
        """
        crops = pictures.crops(frame, regions, self._encoder.side)
        rows = zip(*living.embed(self._encoder, crops), map(is_flat, crops), regions, strict=True)
        matched = [
            (_in_context(self._gallery.match(embedding, is_flat=flat), frame, region), float(alive))
            for embedding, alive, flat, region in rows
        ]
        return [living.with_living(*row) for row in matched]

    def read_texture(self, frame: Frame) -> Evidence:
        """Read the material of a texture map, or of the region of it that the frame names.

        A map that was read before is not read again. Raises PictureError and EncoderError.
        """
        key = texture_verdicts.key_of(frame)
        evidence = self._verdicts.get(key)
        if evidence is None:
            evidence = textures.read(frame, self._encoder, self._gallery, self._embed_windows)
            self._verdicts.put(key, evidence)
        return evidence

    def recognise(
        self,
        frame: Frame,
        subject: str,
        waited_ms: float,
        *,
        force: bool,
        shown: SceneContext | None = None,
    ) -> Recognition:
        """Decode a frame, compare it with the last picture of the same `subject`, embed and match.

        `waited_ms` is how long the frame was queued; `force`: recognise an unchanged picture too.
        `shown` is the object in the picture. With its material it becomes a reference for the other
        objects of its scene; without, it is compared with their references. An object may be
        recognised by the shared recogniser, and so may the windows of a texture map; a whole scene
        (None) stays on this machine. Errors are part of the result.
        """
        stages = {"queue": waited_ms}
        started = time.perf_counter()
        if self._remote is not None:
            self._follow(self._remote)
        if frame.purpose == "texture":
            return self._texture(frame, stages)
        # A scene sends up to 90 frames a second, and most of them show the same as the one before.
        # Identical bytes are skipped without decoding them. Other pictures are compared in a few
        # cells, which costs next to nothing beside embedding them. `force` is set where the same
        # picture may lead to another result: the scene's materials have changed, or the picture is
        # to become a reference.
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

    def _texture(self, frame: Frame, stages: dict[str, float]) -> Recognition:
        """Read a texture map; adds to `stages`."""
        started = time.perf_counter()
        try:
            evidence = self.read_texture(frame)
        except PictureError as error:
            return Recognition(None, stages, error=str(error), error_path=error.path)
        except EncoderError as error:
            return Recognition(None, stages, error=str(error), is_our_fault=True)
        stages["texture"], _ = _lap(started)
        return Recognition(evidence, stages)

    def _match(
        self,
        frame: Frame,
        crop: pictures.Crop,
        shown: SceneContext | None,
        stages: dict[str, float],
    ) -> Recognition:
        """Embed a crop, here or by the shared recogniser, and match it; adds to `stages`."""
        started = time.perf_counter()
        flat = is_flat(crop)
        remote_match = None
        if self._remote is not None and shown is not None:
            remote_match = self._ask_remote(self._remote, frame, crop)
            stages["remote"], started = _lap(started)
        if remote_match is not None:
            embedding = remote_match.embedding
            evidence = remote_match.evidence
            if evidence.confidence <= 0.0:
                evidence = self._gallery.match(embedding, is_flat=flat)
            evidence = _in_context(evidence, frame, frame.region)
        else:
            try:
                (embedding,), (alive,) = living.embed(self._encoder, [crop])
            except EncoderError as error:
                return Recognition(None, stages, error=str(error), is_our_fault=True)
            stages["encode"], started = _lap(started)
            matched = self._gallery.match(embedding, is_flat=flat)
            matched = _in_context(matched, frame, frame.region)
            evidence = living.with_living(matched, float(alive))
        if shown is not None:
            evidence = self._with_scene_references(evidence, embedding, shown, flat=flat)
        stages["match"], _ = _lap(started)
        brightness = tones.brightness(crop.image, crop.levels)
        return Recognition(evidence, stages, SceneView(embedding, brightness))

    def _follow(self, remote: RemoteRecogniser) -> None:
        """Recognise every object again when another encoder or gallery answers from now on."""
        remote.probe()
        answering = "" if remote.identity is None else remote.identity.hash
        # Distances between embeddings of two encoders mean nothing. When the shared recogniser
        # comes or goes, all pictures count as changed, so that each object is recognised again by
        # the encoder that answers now, and no decision is a mixture. For the same reason a scene's
        # references are kept apart by encoder (`_with_scene_references`).
        if answering != self._answered_by:
            self._answered_by = answering
            self._last_pictures.clear()

    def _ask_remote(
        self, remote: RemoteRecogniser, frame: Frame, crop: pictures.Crop
    ) -> RemoteMatch | None:
        identity = remote.identity
        if identity is not None and identity.side != self._encoder.side:
            # The crop is cut from the frame again instead of being resized: the other encoder may
            # take more pixels than this crop kept.
            crop = pictures.crop(frame, identity.side)
        matches = remote.recognise([crop])
        if matches is None:
            self._answered_by = ""
            return None
        # A recogniser that believes nothing of a crop may be well: its gallery has nothing like it.
        # Taking that for the answer would leave the object unknown where this machine may know it.
        if matches[0].evidence.confidence <= 0.0 and not self._has_our_encoder(remote):
            return None
        return matches[0]

    def _embed_windows(self, crops: Sequence[pictures.Crop]) -> NDArray[np.float32]:
        """Embed windows of a texture map, (N, D): elsewhere only where it is the same encoder.

        The layer that reads them is of this machine's encoder. Raises EncoderError.
        """
        matches = None
        if self._remote is not None and self._has_our_encoder(self._remote):
            matches = self._remote.recognise(crops)
        if matches is None:
            return self._encoder.embed(crops)
        return np.stack([match.embedding for match in matches])

    def _has_our_encoder(self, remote: RemoteRecogniser) -> bool:
        """Whether embeddings of the shared recogniser may be compared with this gallery."""
        return remote.identity is not None and remote.identity.encoder == self._encoder.name

    def _with_scene_references(
        self,
        evidence: Evidence,
        embedding: NDArray[np.float32],
        shown: SceneContext,
        *,
        flat: bool,
    ) -> Evidence:
        scene = f"{self._answered_by} {shown.scene}"  # embeddings of two encoders do not compare
        references = self._scenes.pop(scene, None) or SceneReferences()
        self._scenes[scene] = references
        if len(self._scenes) > MAX_TAUGHT_SCENES:
            self._scenes.popitem(last=False)
        if shown.material is not None and shown.object_id is not None:
            references.add(shown.object_id, shown.material, embedding)
            return evidence
        return references.adjust(evidence, embedding, shown.object_id, is_flat=flat)

    def _is_the_same(self, subject: str, digest: bytes) -> bool:
        """Whether the last frame of this subject had the same bytes."""
        before = self._last_pictures.get(subject)
        return before is not None and before.digest == digest

    def _is_unchanged(self, subject: str, crop: pictures.Crop, digest: bytes) -> bool:
        signature = pictures.signature(crop)
        before = self._last_pictures.get(subject)
        if before is not None and not pictures.has_changed(before.signature, signature):
            before.digest = digest
            return True
        self._last_pictures[subject] = _LastPicture(signature, digest)
        # Subjects are named by clients, so without a bound a client could fill the memory. One that
        # was dropped is recognised once more; nothing else happens.
        self._last_pictures.move_to_end(subject)
        if len(self._last_pictures) > MAX_LAST_PICTURES:
            self._last_pictures.popitem(last=False)
        return False


def _in_context(evidence: Evidence, frame: Frame, region: Region | None) -> Evidence:
    """Return beliefs as under SPOT_EXPONENT of the logits' scale, if only a region is known.

    A mask tells the thing from what lies around it, and so does a picture of it alone.
    """
    if frame.mask is not None or region is None or min(region.w, region.h) >= 1.0:
        return evidence
    powers = {name: p**SPOT_EXPONENT for name, p in evidence.beliefs}
    rest = max(0.0, 1.0 - sum(p for _, p in evidence.beliefs)) ** SPOT_EXPONENT
    total = sum(powers.values()) + rest
    return ranked(evidence.rung, {name: p / total for name, p in powers.items()})


def _digest(frame: Frame) -> bytes:
    """Return 16 bytes that differ when anything differs that the crop depends on."""
    digest = hashlib.blake2b(frame.image, digest_size=16)
    shape = (frame.format, frame.width, frame.height, frame.origin, frame.region)
    digest.update(repr(shape).encode())
    digest.update(frame.mask or b"")
    return digest.digest()


def _lap(started: float) -> tuple[float, float]:
    now = time.perf_counter()
    return (now - started) * 1000.0, now
