"""Recognises the material that one picture shows, by its pixels alone.

`hapticvlm.recognise` and `hapticvlm recognise` are this. A thing on a plain ground is outlined and
recognised by itself too, and the mean of both counts (plain_ground.py). Pictures are recognised one
by one: in a batch, one could change the result of another in its last digits.
"""

from __future__ import annotations

import html
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import msgspec

from hapticvlm.evidence.ladder import Verdict, decide, fuse, restrict, with_children
from hapticvlm.evidence.shader import from_shader
from hapticvlm.materials import LIVING, Material, MaterialError
from hapticvlm.messages import Region
from hapticvlm.rendering.felt_error import least_felt_error
from hapticvlm.vision.files import Source, read_frame
from hapticvlm.vision.frame_recogniser import FrameRecogniser
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.galleries.user_materials import read_folder, table_with
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.plain_ground import views

SHOWN = 5  # materials in a notebook
LEAST = 1e-4  # belief in a material of a texture map that is listed


@dataclass(frozen=True, slots=True)
class RecognisedPicture:
    """The material of a picture.

    - `material`: its name, or `unknown` unless the best guess is probably right.
    - `confidence`: the belief in the best guess, 0..1, named or not.
    - `runner_up`: the next material, or the best guess where `material` is `unknown`. None: no
      belief.
    - `beliefs`: the belief in each material, 0..1, the greatest first, and in `living`, a person or
      an animal. They sum to less than 1: the rest is the belief in no material of the gallery.
    - `felt_as`: the believed material whose feeling errs least on average, as the service renders
      an uncertain object (docs/physics.md 4.5). None: no belief, or more in `living`.
    - `source`: `encoder`, or `unknown`.
    - `is_outlined`: whether a thing on a plain ground was outlined.
    """

    material: str
    confidence: float
    runner_up: str | None
    beliefs: Mapping[str, float]
    felt_as: str | None
    source: str
    is_outlined: bool

    def __str__(self) -> str:
        beliefs = [f"{name} {belief:.0%}" for name, belief in list(self.beliefs.items())[:SHOWN]]
        how = ", of the thing on its plain ground" if self.is_outlined else ""
        return (
            f"{self.material}, {self.confidence:.0%} sure, by {self.source}{how}\n"
            f"beliefs: {', '.join(beliefs) or 'none'}\n"
            f"felt as {self.felt_as or 'nothing'}"
        )

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{belief:.0%}</td>"
            f'<td><meter value="{belief:.3f}" aria-label="{html.escape(name)}"></meter></td></tr>'
            for name, belief in list(self.beliefs.items())[:SHOWN]
        )
        guess = "" if self.material == self.felt_as else f", felt as {self.felt_as or 'nothing'}"
        return (
            f"<p><b>{html.escape(self.material)}</b>{html.escape(guess)}</p><table>{rows}</table>"
        )


class PictureRecogniser:
    """An encoder and a gallery, loaded once. `hapticvlm.recognise` uses the shipped ones."""

    def __init__(
        self, recogniser: FrameRecogniser, gallery: Gallery, table: Mapping[str, Material]
    ) -> None:
        self._recogniser = recogniser
        self._gallery = gallery
        self._table = table  # with the user's materials of the gallery

    @classmethod
    def load(
        cls, encoder: str | None = None, gallery: Path | str | None = None
    ) -> PictureRecogniser:
        """Load an encoder and a gallery.

        - `encoder`: name, folder or file of an image network, as `serve --encoder`; None: the
          shipped one.
        - `gallery`: folder or .npz file of reference pictures; None: the shipped ones.

        Raises `HapticVLMError` if one cannot be loaded, or the two do not belong together.

            own = hapticvlm.PictureRecogniser.load(gallery="my-materials")
            own.recognise("photo.jpg")
        """
        loaded = load_encoder(encoder)
        path = None if gallery is None else Path(gallery)
        references = load_gallery(path, encoder=loaded)
        table = table_with(read_folder(path))
        return cls(FrameRecogniser(loaded, references), references, table)

    @property
    def materials(self) -> tuple[str, ...]:
        """The names of the materials that it can tell."""
        return tuple(self._gallery.candidates)

    def check(self, among: Collection[str]) -> None:
        """Raise MaterialError, which lists the materials, unless these are one or more of them."""
        unknown = next((name for name in among if name not in self.materials), None)
        if unknown is None and among and not isinstance(among, str):
            return
        name = (among if isinstance(among, str) else unknown or "")[:60]
        problem = f"no material `{name}` in the gallery" if name else "names no material"
        raise MaterialError(f"among: {problem}; choose from {', '.join(self.materials)}")

    def recognise(
        self,
        picture: Source,
        mask: Source | None = None,
        among: Collection[str] | None = None,
        *,
        outline: bool = True,
    ) -> RecognisedPicture:
        """Recognise the material that a picture shows; `hapticvlm.recognise` has the parameters."""
        if among is not None:
            self.check(among)
        frame = read_frame(picture, mask)
        frames = views(frame) if outline else [frame]
        shown = [self._recogniser.compare(view, [view.region])[0] for view in frames]
        evidence = restrict(fuse(shown), among)
        verdict = decide([evidence], self._table)
        beliefs = with_children(dict(evidence.beliefs), self._table)
        ranked = sorted(beliefs.items(), key=lambda item: -item[1])
        return self._result(verdict, dict(ranked), is_outlined=len(frames) > 1)

    def recognise_texture(
        self,
        picture: Source,
        region: Region | None = None,
        *,
        metallic: float | None = None,
        roughness: float | None = None,
        among: Collection[str] | None = None,
    ) -> RecognisedPicture:
        """Recognise a surface by its base-colour map, beside what its shader implies.

        - `region`: the part of the map that the surface uses (None: all of it).
        - `metallic`, `roughness`: of the surface, or the means of their maps, 0..1.

        Raises FileError and PictureError.
        """
        if among is not None:
            self.check(among)
        frame = msgspec.structs.replace(read_frame(picture, None), region=region)
        shader = from_shader(metallic, roughness, None, None)
        texture = self._recogniser.read_texture(frame)
        given = [restrict(item, among) for item in (shader, texture) if item is not None]
        verdict = decide(given, self._table)
        ranked = sorted(verdict.beliefs.items(), key=lambda item: -item[1])
        beliefs = {name: belief for name, belief in ranked if belief >= LEAST}
        return self._result(verdict, beliefs, is_outlined=False)

    def _result(
        self, verdict: Verdict, beliefs: Mapping[str, float], *, is_outlined: bool
    ) -> RecognisedPicture:
        felt = {name: belief for name, belief in beliefs.items() if belief > 0.0}
        is_felt = felt.pop(LIVING, 0.0) <= verdict.confidence
        return RecognisedPicture(
            verdict.material,
            verdict.confidence,
            verdict.runner_up,
            dict(beliefs),
            least_felt_error(felt, self._table) if felt and is_felt else None,
            verdict.source,
            is_outlined,
        )


def recognise(
    picture: Source,
    mask: Source | None = None,
    among: Collection[str] | None = None,
    *,
    outline: bool = True,
) -> RecognisedPicture:
    """Recognise the material that a picture shows, with the shipped network and references.

    - `picture`: a JPEG, PNG or WebP file, an image of Pillow, or an array of uint8: (H, W) grey,
      (H, W, 3) RGB or (H, W, 4) RGBA, the top row first. Without a mask the whole picture counts:
      crop it to the object.
    - `mask`: the same, of the size of the upright picture, nonzero on the object; an array may be
      of bool.
    - `among`: the names of the only materials to consider, such as `["wood", "glass"]`.
    - `outline`: False leaves a thing on a plain ground, as in a catalogue, as it is.

    Raises `HapticVLMError`, which is also a ValueError, for a picture or a mask that cannot be used
    and a material that the gallery lacks. The network is loaded by the first call, in about half a
    second. docs/figures.md says how often it is right.

        hapticvlm.recognise("photo.jpg", among=["wood", "glass", "metal"]).material
    """
    return _shipped().recognise(picture, mask, among, outline=outline)


@cache
def _shipped() -> PictureRecogniser:
    return PictureRecogniser.load()
