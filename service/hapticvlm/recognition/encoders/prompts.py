"""What a network of pictures and text is asked: a few phrases for each material, and for the rest.

The words are those of the material table. Knows no network.
"""

from __future__ import annotations

from hapticvlm import materials

PHRASES = ("an object made of {}", "a close-up of {}")
REST = ("a person", "an animal", "food", "the sky")
MOST_WORDS = 4  # of a material: further ones name rarer kinds of it


def phrases() -> list[list[str]]:
    """Phrases of each material in the order of the table, and at the end of the rest."""
    found = [
        [phrase.format(word) for word in material.words[:MOST_WORDS] for phrase in PHRASES]
        for material in materials.MATERIALS.values()
    ]
    return [*found, [f"a picture of {word}" for word in REST]]
