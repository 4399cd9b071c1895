"""Tells people and animals by the scores of ImageNet's 1,000 classes, which the shipped graph has.

ImageNet has 398 classes of animals. It has none of a person or a hand, but classes that people are
taken for: what is held at a face (lipstick, a flute), what is worn (a wig, a suit, a bikini), and
persons of a trade. Their probabilities are summed, and a ramp turns each sum into a belief, since a
few per cent of them appear in pictures of anything. Garments that are often photographed without a
person (T-shirts, jeans, pyjamas) do not count: a person in those may be taken for fabric. Nor does
noise, which the network takes for an insect or a rug: there, neighbouring pixels hardly agree.

hapticvlm_lab/training/LOG.md says on which pictures classes and ramps were chosen, and has the
figures of the others.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hapticvlm.evidence.ladder import SURE, Evidence, ranked
from hapticvlm.materials import LIVING
from hapticvlm.vision.encoders.encoder import Encoder, Floats
from hapticvlm.vision.encoders.onnx_encoder import OnnxEncoder
from hapticvlm.vision.pictures import Crop, central_mask

# Left out of the animals: jellyfish, coral and trilobite, which are materials in imagenet.csv, and
# 30 whose pictures look like weave, bark, gravel or tiles (snakes, insects, a shell, a shark).
_AS_MATTER = (
    *(5, 26, 32, 47, 51, 62, 63, 65, 66, 68, 69, 73, 80, 107, 109, 111, 116, 126, 147, 148, 149),
    *(210, 228, 302, 309, 310, 325, 335, 350, 357, 371, 384, 392),
)
# np.setdiff1d would load masked arrays, which take 8 MB of each recogniser
_ANIMALS = np.array([number for number in range(398) if number not in _AS_MATTER])
# face powder, flute, hair slide, lipstick, mask, neck brace, baby's teat, oboe, ocarina, oxygen
# mask, panpipe, shower cap, sunscreen, wig, Windsor tie, bow tie; ball player, groom, scuba diver
_AT_A_FACE = (
    *(551, 558, 584, 629, 643, 678, 680, 683, 684, 691, 699, 793, 838, 903, 906, 457),
    *(981, 982, 983),
)
# academic gown, bathing cap, bearskin, bikini, bonnet, cowboy hat, football helmet, fur coat, gown,
# kimono, lab coat, two kinds of maillot, military uniform, miniskirt, mortarboard, sombrero, stole,
# suit, two kinds of sunglasses; of those at a face bow tie, wig, ball player, groom, scuba diver
_WORN = (
    *(400, 433, 439, 445, 452, 515, 560, 568, 578, 614, 617, 638, 639, 652, 655, 667, 808, 824),
    *(834, 836, 837, 457, 903, 981, 982, 983),
)
_ANIMAL_RAMP = (0.5, 0.9)  # sums of probability with belief 0 and 1
_FACE_RAMP = (0.25, 0.45)
_WORN_RAMP = (0.08, 0.2)  # a few per cent are seldom in pictures without people
_LEAST_AGREEMENT = 0.6  # correlation of neighbouring pixels of the crop, below which it is noise


def embed(encoder: Encoder, crops: Sequence[Crop]) -> tuple[Floats, Floats]:
    """Return embeddings (N, D) and the beliefs (N,) that crops show a person or an animal.

    An encoder that is not of ours has the beliefs 0. Raises EncoderError.
    """
    if not isinstance(encoder, OnnxEncoder) or not encoder.has_classes:
        return encoder.embed(crops), np.zeros(len(crops), np.float32)
    embeddings, classes = encoder.embed_and_classify(crops)
    beliefs = belief(classes, [_is_outlined(crop) for crop in crops])
    return embeddings, beliefs * [not _is_noise(crop) for crop in crops]


def belief(classes: Floats, outlined: Sequence[bool]) -> Floats:
    """Turn probabilities of classes (N, 1000) into beliefs in people and animals (N,).

    In a picture without an outline (N,), a hat mostly has a head below it. A scene that outlines
    one says that the hat is a thing.
    """
    animal = np.interp(classes[:, _ANIMALS].sum(axis=1), _ANIMAL_RAMP, (0.0, 1.0))
    face = np.interp(classes[:, _AT_A_FACE].sum(axis=1), _FACE_RAMP, (0.0, 1.0))
    worn = np.interp(classes[:, _WORN].sum(axis=1), _WORN_RAMP, (0.0, 1.0))
    worn = np.where(outlined, 0.0, worn)
    return np.asarray(np.maximum(np.maximum(animal, face), worn), np.float32)


def _is_outlined(crop: Crop) -> bool:
    return not np.array_equal(crop.mask, central_mask(len(crop.mask)))


def _is_noise(crop: Crop) -> bool:
    levels = crop.image.sum(axis=2, dtype=np.float32)
    levels -= levels.mean()
    least = _LEAST_AGREEMENT * np.square(levels).mean()
    across = np.mean(levels[:, 1:] * levels[:, :-1])
    down = np.mean(levels[1:] * levels[:-1])
    return bool(max(abs(across), abs(down)) < least)


def with_living(evidence: Evidence, belief: float) -> Evidence:
    """Give this belief to LIVING, at the expense of all materials, unless one of them is sure."""
    if belief <= 0.0 or evidence.confidence >= SURE:
        return evidence
    beliefs = {name: (1.0 - belief) * p for name, p in evidence.beliefs}
    return ranked(evidence.rung, {**beliefs, LIVING: belief})
