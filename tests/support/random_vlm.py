"""A small Qwen2-VL with random weights: the real architecture without any knowledge.

The agreement of two implementations does not depend on the weights; answers do, so no answer of a
random model is ever reported. The tokenizer is a stand-in made of the words it is given, whole as
Qwen's own has them, its digits single, so that prompts are about as long as with Qwen's.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

END = "<|im_end|>"
PAD = "<|endoftext|>"
START = "<|im_start|>"
IMAGE = "<|image_pad|>"
VIDEO = "<|video_pad|>"
VISION = ("<|vision_start|>", "<|vision_end|>")
IMAGE_TOKENS = 256  # at most, of one picture
# As Qwen2-VL's own template, for one picture or more in a message.
TEMPLATE = (
    "{% for m in messages %}{% if loop.first and m.role != 'system' %}"
    "<|im_start|>system\nYou are a helpful assistant.<|im_end|>\n{% endif %}"
    "<|im_start|>{{ m.role }}\n"
    "{% if m.content is string %}{{ m.content }}{% else %}{% for part in m.content %}"
    "{% if part.type == 'image' %}<|vision_start|><|image_pad|><|vision_end|>"
    "{% elif part.type == 'image_url' %}<|vision_start|><|image_pad|><|vision_end|>"
    "{% elif 'text' in part %}{{ part.text }}{% endif %}{% endfor %}{% endif %}<|im_end|>\n"
    "{% endfor %}{% if add_generation_prompt %}<|im_start|>assistant\n{% endif %}"
)


def stand_in_tokenizer(texts: Iterable[str]) -> Any:
    """Make a Qwen2 tokenizer whose entries are the words of the texts, bytes and single digits."""
    from tokenizers import Regex, Tokenizer, models, pre_tokenizers, trainers
    from transformers import Qwen2Tokenizer
    from transformers.models.qwen2.tokenization_qwen2 import PRETOKENIZE_REGEX

    split = pre_tokenizers.Split(Regex(PRETOKENIZE_REGEX), "isolated")
    into_bytes = pre_tokenizers.ByteLevel(add_prefix_space=False, use_regex=False)
    trained = Tokenizer(models.BPE())
    trained.pre_tokenizer = pre_tokenizers.Sequence([split, into_bytes])
    alphabet = pre_tokenizers.ByteLevel.alphabet()
    trainer = trainers.BpeTrainer(
        vocab_size=8192, min_frequency=1, initial_alphabet=alphabet, show_progress=False
    )
    trained.train_from_iterator(list(texts), trainer)
    learned = json.loads(trained.to_str())["model"]
    merges = [tuple(pair) for pair in learned["merges"]]
    tokenizer = Qwen2Tokenizer(
        vocab=learned["vocab"], merges=merges, eos_token=END, pad_token=PAD, chat_template=TEMPLATE
    )
    special = [PAD, START, END, *VISION, IMAGE, VIDEO]
    tokenizer.add_special_tokens({"additional_special_tokens": special})
    return tokenizer


def image_processor(image_tokens: int) -> Any:
    """Make Qwen2-VL's own image processor with that many tokens at most."""
    from transformers.models.qwen2_vl.image_processing_pil_qwen2_vl import Qwen2VLImageProcessorPil

    return Qwen2VLImageProcessorPil(min_pixels=4 * 28 * 28, max_pixels=image_tokens * 28 * 28)


def config(tokenizer: Any) -> Any:
    """Make the configuration of a small Qwen2-VL, its head tied to its embedding."""
    from transformers import Qwen2VLConfig

    id_of = tokenizer.convert_tokens_to_ids
    text = {
        "hidden_size": 64,
        "intermediate_size": 128,
        "num_hidden_layers": 2,
        "num_attention_heads": 4,
        "num_key_value_heads": 2,
        "vocab_size": -(-len(tokenizer) // 64) * 64,
        "max_position_embeddings": 32768,
        "rms_norm_eps": 1e-6,
        "rope_parameters": {
            "rope_type": "default",
            "rope_theta": 1e6,
            "mrope_section": [2, 3, 3],  # of a head's half: time, height, width
        },
        "bos_token_id": id_of(PAD),
        "eos_token_id": id_of(END),
        "pad_token_id": id_of(PAD),
        "tie_word_embeddings": True,
    }
    vision = {"depth": 2, "embed_dim": 32, "hidden_size": 64, "num_heads": 2, "mlp_ratio": 4}
    return Qwen2VLConfig(
        text_config=text,
        vision_config=vision,
        tie_word_embeddings=True,
        image_token_id=id_of(IMAGE),
        video_token_id=id_of(VIDEO),
        vision_start_token_id=id_of(VISION[0]),
        vision_end_token_id=id_of(VISION[1]),
    )


def random_network(configuration: Any, seed: int, sd: float) -> Any:
    """Make the network with normal random weights of this standard deviation, float32."""
    import torch
    from transformers import GenerationConfig, Qwen2VLForConditionalGeneration
    from transformers.initialization import no_init_weights

    # Otherwise every weight is initialised twice: by the library, and by the loop below.
    with no_init_weights():
        model = Qwen2VLForConditionalGeneration._from_config(configuration, dtype=torch.float32)
    model.tie_weights()
    rng = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for weight in model.parameters():
            weight.normal_(0.0, sd, generator=rng) if weight.dim() > 1 else weight.fill_(1.0)
    text = configuration.text_config
    ends: Any = GenerationConfig
    model.generation_config = ends(eos_token_id=text.eos_token_id, pad_token_id=text.pad_token_id)
    return model.eval()


def write(folder: Path, texts: Iterable[str], seed: int, sd: float) -> None:
    """Write a folder as save_pretrained does: network, tokenizer of these texts, image processor.

    sd: of the weights.
    """
    tokenizer = stand_in_tokenizer(texts)
    model = random_network(config(tokenizer), seed, sd)
    for part in (model, tokenizer, image_processor(IMAGE_TOKENS)):
        part.save_pretrained(folder)
