"""Asks a vision-language network of transformers for next-token probabilities, by torch.

A readout is one forward pass; the key-value cache of a prompt's head is computed once and kept.
Positions are passed explicitly, because a packed pass places several texts at the same positions.
Those of the Qwen-VL family are three-dimensional within a picture, and continue after it from the
largest one used instead of the number of tokens. Knows no tokenizer and no words.
"""

from __future__ import annotations

import copy
import inspect
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.errors import short_line
from hapticvlm.vlm.chat import Prompt
from hapticvlm.vlm.contract import VlmError
from hapticvlm.vlm.limits import KEPT_HEADS
from hapticvlm.vlm.numbers import ChoiceTree, Packed, pack

if TYPE_CHECKING:
    from torch import Tensor

CURE_MEMORY = "ask with fewer image tokens, give the machine more memory or name a smaller model"


class Network:
    """A loaded image-text-to-text model of transformers on its device."""

    def __init__(self, model: Any) -> None:  # noqa: ANN401 - any kind
        self.model = model
        self._heads: OrderedDict[tuple[int, ...], Any] = OrderedDict()

    def readout(self, prompt: Prompt, tree: ChoiceTree) -> NDArray[np.float32]:
        """Return log-probabilities (wordings, nodes, vocabulary) from one pass. Raises VlmError."""
        with guarded("the model's pass"):
            packed = pack(prompt.tails, tree)
            rows = len(prompt.body) + packed.rows.ravel()
            flat = log_probs(self._pass(prompt, packed, rows)[0])
            return flat.reshape((*packed.rows.shape, flat.shape[-1]))

    def following(self, prompt: Prompt, tokens: Sequence[int] = ()) -> NDArray[np.float32]:
        """Return log-probabilities (vocabulary,) of the token after the first wording and `tokens`.

        A plain pass without packing or cached heads, against which a readout is checked.
        """
        with guarded("the model's pass"):
            whole = (*prompt.head, *prompt.body, *prompt.tails[0], *tokens)
            shared = len(prompt.head) + len(prompt.body)
            steps = np.arange(len(whole) - shared)
            positions = self._positions(prompt, steps)
            logits = self._call(whole, positions, **prompt.tensors).logits
            beliefs: NDArray[np.float32] = log_probs(logits[0, -1:])[0]
            return beliefs

    def _pass(self, prompt: Prompt, packed: Packed, rows: NDArray[np.int64]) -> Tensor:
        """Run a prompt's body and the packed tokens after it; logits (1, rows, vocabulary)."""
        import torch

        ids = (*prompt.body, *packed.ids.tolist())
        positions = self._positions(prompt, packed.steps)[..., -len(ids) :]
        logits: Tensor = self._call(
            ids,
            positions,
            attention_mask=self._mask(len(prompt.head) + len(prompt.body), packed, len(ids)),
            past_key_values=self._head(prompt.head),
            logits_to_keep=torch.from_numpy(rows).to(self.model.device),
            **prompt.tensors,
        ).logits
        return logits

    def _head(self, head: tuple[int, ...]) -> Any:  # noqa: ANN401 - a cache of transformers
        """Return a copy of the head's key-value cache, into which a pass writes."""
        if not head:
            return None
        if head not in self._heads:
            self._heads[head] = self._call(head, self._flat(np.arange(len(head)))).past_key_values
        self._heads.move_to_end(head)
        while len(self._heads) > KEPT_HEADS:
            self._heads.popitem(last=False)
        return copy.deepcopy(self._heads[head])

    def _positions(self, prompt: Prompt, steps: NDArray[np.int64]) -> Tensor:
        """Return positions of head and body, then of tokens `steps` after: (3, 1, L) or (1, L)."""
        import torch

        shared = self._shared_positions((*prompt.head, *prompt.body), prompt.tensors)
        after = self._flat(steps) + shared.max() + 1
        return torch.cat([shared, after], dim=-1)

    def _shared_positions(self, ids: Sequence[int], tensors: Mapping[str, Any]) -> Tensor:
        import torch

        if not self._is_spatial:
            return self._flat(np.arange(len(ids)))
        tokens = torch.tensor([ids])
        known: dict[str, Any] = {
            "input_ids": tokens,
            "image_grid_thw": tensors["image_grid_thw"],
            "mm_token_type_ids": (tokens == self.model.config.image_token_id).int(),
        }
        find = self.model.model.get_rope_index
        parameters = inspect.signature(find).parameters  # the last one is new in transformers 5
        positions: Tensor = find(**{name: known[name] for name in known if name in parameters})[0]
        return positions.to(self.model.device)

    def _flat(self, places: NDArray[np.int64]) -> Tensor:
        """Return text positions in the form the network expects: (3, 1, L) or (1, L)."""
        import torch

        flat = torch.from_numpy(places).to(self.model.device)[None]
        return flat.expand(3, 1, -1) if self._is_spatial else flat

    @property
    def _is_spatial(self) -> bool:
        return hasattr(self.model.model, "get_rope_index")

    def _mask(self, shared: int, packed: Packed, rows: int) -> Tensor:
        """Return the additive attention mask (1, 1, rows, L): 0 where a row attends to a column."""
        import torch

        size = shared + len(packed.ids)
        sees = torch.ones(size, size, dtype=torch.bool).tril()
        sees[shared:, shared:] = torch.from_numpy(packed.sees)
        hidden = torch.zeros(size, size).masked_fill(~sees, torch.finfo(self.model.dtype).min)
        return hidden[None, None, -rows:].to(self.model.device, self.model.dtype)

    def _call(self, ids: Sequence[int], positions: Tensor, **arguments: Any) -> Any:  # noqa: ANN401
        import torch

        options = {"logits_to_keep": 1, **arguments}
        tensors = {name: self._placed(value) for name, value in options.items()}
        tokens = torch.tensor([ids], device=self.model.device)
        return self.model(input_ids=tokens, position_ids=positions, use_cache=True, **tensors)

    def _placed(self, value: Any) -> Any:  # noqa: ANN401 - tensors and other values
        import torch

        if not isinstance(value, torch.Tensor):
            return value
        value = value.to(self.model.device)
        return value.to(self.model.dtype) if value.is_floating_point() else value


def log_probs(logits: Tensor) -> NDArray[np.float32]:
    """Normalise logits (N, vocabulary). Raises VlmError if any is not finite."""
    import torch

    wrong = int((~torch.isfinite(logits)).sum())
    if wrong:
        problem = f"the model gives NaN or infinite logits ({wrong} of {logits.numel()})"
        raise VlmError(f"{problem}; its weights may be damaged")
    normalised: NDArray[np.float32] = torch.log_softmax(logits.float(), dim=-1).cpu().numpy()
    return normalised


@contextmanager
def guarded(doing: str) -> Iterator[None]:
    """Run without gradients; turn errors of a network, and lack of memory, into VlmError."""
    import torch

    try:
        with torch.inference_mode():
            yield
    except (MemoryError, RuntimeError, ValueError, TypeError, LookupError, AttributeError) as error:
        # Torch reports a lack of memory of a GPU by an error of its own, of the cpu in words alone.
        is_memory = isinstance(error, MemoryError | torch.OutOfMemoryError)
        if is_memory or "alloc" in str(error):
            problem = f"{doing} ran out of memory ({short_line(error)})"
            raise VlmError(f"{problem}: {CURE_MEMORY}") from None
        raise VlmError(f"{doing} failed ({type(error).__name__}: {short_line(error)})") from error
