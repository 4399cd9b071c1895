"""A tiny LLaVA with a planted answer, for servers that load a model with its whole processor.

Qwen2-VL's own processor needs torchvision for videos, LLaVA's does not. The planted network is a
chain of characters: embeddings are the unit matrix, attention and MLP write nothing, so the last
character alone picks the next one through the head. Any picture and prompt get the same answer.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

START = ">"  # what the chat template ends with
SPECIAL = ("<s>", "</s>", "<pad>", "<image>")
SIDE, PATCH = 28, 14  # px
TEMPLATE = (
    "{% for m in messages %}{{ m.role }}: {% for c in m.content %}"
    "{% if c.type == 'text' %}{{ c.text }}{% else %}<image>{% endif %}"
    "{% endfor %}\n{% endfor %}{% if add_generation_prompt %}=>{% endif %}"
)


def write_llava(folder: Path, answer: str) -> Path:
    """Write a model that always says `answer`, no character of which may repeat, and stops."""
    import torch
    from transformers import LlavaForConditionalGeneration

    tokenizer = _tokenizer()
    _processor(tokenizer).save_pretrained(folder)
    torch.manual_seed(0)
    model = LlavaForConditionalGeneration(_config(tokenizer))
    chain = [*(tokenizer.convert_tokens_to_ids(c) for c in START + answer), tokenizer.eos_token_id]
    with torch.no_grad():
        for layer in model.model.language_model.layers:
            layer.self_attn.o_proj.weight.zero_()
            layer.mlp.down_proj.weight.zero_()
        torch.nn.init.eye_(model.model.language_model.embed_tokens.weight)
        model.lm_head.weight.zero_()
        for here, there in pairwise(chain):
            model.lm_head.weight[there, here] = 1.0
    model.generation_config.do_sample = False
    model.generation_config.eos_token_id = tokenizer.eos_token_id
    model.save_pretrained(folder)
    return folder


def _tokenizer() -> Any:
    from tokenizers import Tokenizer, decoders, models, pre_tokenizers
    from transformers import PreTrainedTokenizerFast

    alphabet = sorted(pre_tokenizers.ByteLevel.alphabet())
    inner = Tokenizer(models.BPE(vocab={c: at for at, c in enumerate(alphabet)}, merges=[]))
    inner.pre_tokenizer = pre_tokenizers.ByteLevel(add_prefix_space=False, use_regex=False)
    inner.decoder = decoders.ByteLevel()
    inner.add_special_tokens(list(SPECIAL))
    return PreTrainedTokenizerFast(
        tokenizer_object=inner,
        bos_token="<s>",
        eos_token="</s>",
        pad_token="<pad>",
        extra_special_tokens={"image_token": "<image>"},
    )


def _processor(tokenizer: Any) -> Any:
    from transformers import LlavaProcessor
    from transformers.models.clip.image_processing_pil_clip import CLIPImageProcessorPil

    pictures = CLIPImageProcessorPil(
        size={"shortest_edge": SIDE}, crop_size={"height": SIDE, "width": SIDE}
    )
    return LlavaProcessor(
        image_processor=pictures,
        tokenizer=tokenizer,
        patch_size=PATCH,
        vision_feature_select_strategy="default",
        chat_template=TEMPLATE,
        num_additional_image_tokens=1,
    )


def _config(tokenizer: Any) -> Any:
    from transformers import CLIPVisionConfig, LlamaConfig, LlavaConfig

    width = len(tokenizer)
    seeing = CLIPVisionConfig(
        hidden_size=16,
        intermediate_size=16,
        num_hidden_layers=2,
        num_attention_heads=2,
        image_size=SIDE,
        patch_size=PATCH,
    )
    speaking = LlamaConfig(
        vocab_size=width,
        hidden_size=width,
        intermediate_size=16,
        num_hidden_layers=1,
        num_attention_heads=2,
        bos_token_id=tokenizer.bos_token_id,
        eos_token_id=tokenizer.eos_token_id,
        pad_token_id=tokenizer.pad_token_id,
    )
    image = tokenizer.convert_tokens_to_ids("<image>")
    return LlavaConfig(
        vision_config=seeing, text_config=speaking, image_token_index=image, vision_feature_layer=-1
    )
