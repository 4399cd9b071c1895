"""The methods to recognise a material that the chart compares, behind one interface.

A method has an encoder (crop to embedding) with a gallery (embedding to beliefs), or rungs that
read what the scene states of an object, or both; each is asked through the product's own functions.
No picture of the source that is charted has taught, chosen or calibrated any of them: they answer
zero-shot. A method that is not available on this machine is left out and reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hapticvlm import messages
from hapticvlm.vision.encoders.encoder import Encoder, EncoderError
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import GalleryError, load_gallery
from hapticvlm.vision.loading import load_encoder
from hapticvlm_lab.bench.material.data import Cut, Source

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Family = Literal["guess", "stated", "named", "ours", "ladder"]

NAME: frozenset[messages.Rung] = frozenset({"name"})
SHADER: frozenset[messages.Rung] = frozenset({"shader"})
TEXTURE: frozenset[messages.Rung] = frozenset({"texture"})


@dataclass(frozen=True, eq=False)
class Method:
    """One row of the chart. `cut` None: objects are cut out as the source allows.

    `refers`: beliefs are adjusted by references to the named objects of the same scene.
    `surfaces`: the rung of names reads those of surfaces, too.
    """

    name: str
    family: Family
    encoder: Encoder | None = None
    gallery: Gallery | None = None
    rungs: frozenset[messages.Rung] = frozenset()
    cut: Cut | None = None
    is_default: bool = False
    refers: bool = False
    surfaces: bool = False

    def fits(self, source: Source) -> bool:
        """Return whether the source has what this method needs: a rung needs statements."""
        return bool(source.stated) or not self.rungs


def assemble(named: Sequence[str]) -> tuple[list[Method], list[str]]:
    """List the available methods, and the reasons why others are not.

    named: networks as `--encoder` takes them. Raises EncoderError, GalleryError.
    """
    methods = [
        Method("majority", "guess"),
        Method("name", "stated", rungs=NAME),
        Method("shader", "stated", rungs=SHADER),
    ]
    skipped: list[str] = []
    for name in named:
        try:
            methods.append(_network(name))
        except (EncoderError, GalleryError, OSError) as error:
            skipped.append(f"{name}: {error}")
    return [*methods, *_combinations()], skipped


def networks(data: Path | None) -> list[str]:
    """List the ImageNet networks of the data folder."""
    return [] if data is None else sorted(map(str, data.glob("teacher/*.onnx")))


def _combinations() -> list[Method]:
    """Return the default, and what changes with the cut and with the other rungs."""
    encoder = load_encoder()
    default = Method("ours", "ours", encoder, load_gallery(encoder=encoder), is_default=True)
    other = replace(default, is_default=False)
    return [
        default,
        replace(other, name="ours, centre", cut="centre"),
        replace(other, name="ladder", family="ladder", rungs=NAME | SHADER),
    ]


def _network(name: str) -> Method:
    """Load a network as the service does: its own classes, and our rooms as references."""
    encoder = load_encoder(name)
    return Method(Path(name).stem, "named", encoder, load_gallery(encoder=encoder))
