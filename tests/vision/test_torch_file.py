"""Weights in torch's older format: whole files are read, all others refused, and nothing is run."""

import time
from pathlib import Path

import numpy as np
import pytest
from each_case import each
from hypothesis import given, settings
from hypothesis import strategies as st
from torch_files import Tensor, calling, file_of

from hapticvlm.vision.encoders.packaged_weights import MAX_BYTES, TorchFileError, read_arrays

SIX = {"k": [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]}
WHOLE = file_of({"a": Tensor(), "b": Tensor((3,), (2,), 1)}, SIX)


def test_views_of_a_storage_are_read_by_their_strides() -> None:
    found = read_arrays(WHOLE)
    assert found["a"].tolist() == [[0, 1, 2], [3, 4, 5]]
    assert found["b"].tolist() == [1, 3, 5]
    turned = read_arrays(file_of({"a": Tensor((3, 2), (1, 3))}, SIX))
    assert turned["a"].tolist() == [[0, 3], [1, 4], [2, 5]]
    assert not found["a"].flags.writeable


@pytest.mark.parametrize(
    ("module", "name", "argument"),
    [
        ("os", "system", "touch {path}"),
        ("builtins", "exec", "open({path!r}, 'w')"),
        ("builtins", "eval", "open({path!r}, 'w')"),
        ("pathlib", "Path.touch", "{path}"),
        ("torch", "load", "{path}"),
        ("torch._utils", "_rebuild_tensor", "{path}"),
        ("collections", "OrderedDict.fromkeys", "{path}"),
        ("numpy", "memmap", "{path}"),
    ],
)
def test_a_file_that_names_a_function_has_nothing_run(
    tmp_path: Path, module: str, name: str, argument: str
) -> None:
    path = tmp_path / "made"
    hostile = calling(module, name, argument.format(path=str(path)))
    with pytest.raises(TorchFileError, match="which weights do not need"):
        read_arrays(file_of({"a": Tensor()}, SIX, pickled=hostile))
    assert not path.exists()


@each(
    tensor=[
        Tensor((2, 4), (3, 1)),  # one too many
        Tensor((2, 3), (4, 1)),
        Tensor((2, 3), (3, 1), offset=1),
        Tensor((2, 3), (-3, 1), offset=3),
        Tensor((2, 3), (3, 1), offset=-1),
        Tensor((2, 3), (3,)),
        Tensor((0, 3), (3, 1)),
        Tensor((60_000_000,) * 4, (0,) * 4),  # a view of one number, of any size
        Tensor((1,) * 9, (1,) * 9),
        Tensor(key="elsewhere"),
        Tensor(count=5),
        Tensor(count=2**60),
    ]
)
def test_a_view_that_leaves_its_storage_is_refused(tensor: Tensor) -> None:
    with pytest.raises(TorchFileError):
        read_arrays(file_of({"a": tensor}, SIX))


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04", b"\x80\x02K\x01.", b"\x80", b"." * 99])
def test_a_file_that_is_not_a_torch_file_is_refused_with_a_reason(data: bytes) -> None:
    with pytest.raises(TorchFileError):
        read_arrays(data)


def test_a_huge_file_is_refused_before_it_is_read() -> None:
    began = time.process_time()
    with pytest.raises(TorchFileError, match="at most"):
        read_arrays(bytes(MAX_BYTES + 1))
    assert time.process_time() - began < 0.1


@given(
    cut=st.integers(0, len(WHOLE) - 1),
    at=st.integers(0, len(WHOLE) - 1),
    new=st.binary(max_size=8),
)
@settings(max_examples=120, deadline=None)
@pytest.mark.slow
def test_any_damage_is_an_error_or_leaves_plain_numbers(cut: int, at: int, new: bytes) -> None:
    for data in (WHOLE[:cut], WHOLE[:at] + new + WHOLE[at + len(new) :], WHOLE[:at] + WHOLE[cut:]):
        try:
            found = read_arrays(data)
        except TorchFileError:
            continue
        for array in found.values():
            assert array.dtype in (np.dtype("<f4"), np.dtype("<i8"))
            array.copy()  # reads every number that it shows
