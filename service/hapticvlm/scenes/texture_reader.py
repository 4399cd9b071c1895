"""Reads the textures of a scene's files as the service reads those that a client sends."""

from __future__ import annotations

from pathlib import Path

from hapticvlm.cache_folder import cache_folder
from hapticvlm.errors import printable
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.scenes.scene import SceneError, Texture
from hapticvlm.vision import texture_verdicts
from hapticvlm.vision.encoders.encoder import EncoderError
from hapticvlm.vision.files import FileError, decode_frame
from hapticvlm.vision.frame_recogniser import FrameRecogniser
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.pictures import PictureError
from hapticvlm.vision.texture_verdicts import TextureVerdicts


class TextureReader:
    """The shipped encoder and gallery, loaded at the first texture.

    `problems` has a sentence for each texture that could not be read. What a texture showed is kept
    in the cache folder of the service, so that the next scan does not read it again.
    """

    def __init__(self) -> None:
        self.problems: list[str] = []
        self._recogniser: FrameRecogniser | None = None

    def __call__(self, texture: Texture) -> Evidence | None:
        """Return what a texture shows; None if it cannot be read."""
        name = printable(texture.name or "a texture without a name", 80)
        try:
            frame = decode_frame(texture.read(), Path(name))
            return self._loaded().read_texture(frame)
        except SceneError as error:
            self.problems.append(f"{name}: {error}")
        except (FileError, PictureError, EncoderError) as error:
            self.problems.append(str(error))
        return None

    def _loaded(self) -> FrameRecogniser:
        if self._recogniser is None:
            encoder = load_encoder(None)
            gallery = load_gallery(None, encoder=encoder)
            name = texture_verdicts.file_name(encoder, gallery)
            verdicts = TextureVerdicts(None if name is None else cache_folder() / name)
            self._recogniser = FrameRecogniser(encoder, gallery, verdicts=verdicts)
        return self._recogniser
