"""The elementary functions in C give the bits of Python, at special values too."""

import math
from itertools import product

import pytest
from fmi_blocks import face_of
from native_block import NativeBlock, numbers

SPECIAL = (0.0, -0.0, math.inf, -math.inf, math.nan, 5e-324, 1.7976931348623157e308, math.pi / 2, -745.2, 709.79, 1.0)


@pytest.mark.parametrize("options", [(), ("-O0",)], ids=["optimized", "as written"])
def test_elementary_functions_give_the_same_bits(options, tmp_path):
    native = NativeBlock(face_of("elementary"), tmp_path, *options)
    values = numbers(6000)
    for a, b in [*product(SPECIAL, SPECIAL), *zip(values, values[3:], strict=False)]:
        native.set(a=a, b=b)
        native.block.step(native.python, 0.0, 1.0)
        native.model.step(native.values, 0.0, 1.0, None)
        differing = {n: p for n, p in native.differing().items() if not (p[0] != p[0] and p[1] != p[1])}
        assert differing == {}, (a, b)
