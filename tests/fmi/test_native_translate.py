"""A block's C does what its Python does, bit for bit; what C cannot do alike is refused with file, line and rule."""

import itertools
import textwrap

import pytest
from fmi_blocks import BLOCKS, OWN, face_of
from native_block import NativeBlock, numbers

from twip.errors import TwipError
from twip.fmi.blocks import load_block
from twip.fmi.native.block_source import block_source

OPTIONS = [(), ("-O0",)]


@pytest.fixture(scope="module", params=OPTIONS, ids=["optimized", "as written"])
def subset(request, tmp_path_factory):
    return NativeBlock(face_of("subset"), tmp_path_factory.mktemp("subset"), *request.param)


def test_every_construct_gives_the_same_bits(subset):
    values = [x for x in numbers(3000) if abs(x) < 1e15]
    for k, (a, b, c) in enumerate(itertools.islice(zip(values, values[1:], values[7:]), 2000)):  # noqa: B905
        subset.set(a=a, b=b, c=c)
        if k % 50 == 0:
            subset.initialize(0.1 * k)
            assert subset.differing() == {}, (a, b, c)
        subset.step(0.1 * k, 0.1)
        assert subset.differing() == {}, (a, b, c)


def test_sentences_of_a_check_are_the_same(subset):
    several = 0
    for low, high in zip(numbers(4000, 2), numbers(4000, 3), strict=False):
        subset.set(low_limit=low, high_limit=high)
        told = subset.told()
        assert told == subset.block.check(subset.python)
        several += len(told) > 1
    assert several > 100


def test_a_reader_finds_the_python_again(subset):
    assert "subset/subset.py:" in subset.text
    assert "Use everything once." in subset.text
    assert "/* a comment above a statement stays */" in subset.text
    assert "A comment's end, * /, must not end it in C." in subset.text
    assert max(len(line) for line in subset.text.splitlines() if '"' not in line) <= 120


@pytest.mark.parametrize("simple", [*BLOCKS, "walker", "typed"])
def test_a_block_gives_the_same_bits(simple, tmp_path):
    native = NativeBlock(face_of(simple), tmp_path)
    native.initialize()
    assert native.differing() == {}
    inputs = [v for v in native.block.variables if v.causality == "input"]
    for k in range(500):
        native.set(**{v.attribute: v.start + 0.1 * ((k * 7 + 3 * i) % 11 - 5) / 5 for i, v in enumerate(inputs)})
        native.step(k * 1e-3, 1e-3)
        assert native.differing() == {}, k


FACE = '''
from math import floor, gamma, log
from typing import Any, NamedTuple
from twip.fmi.declare import Block, input, output
from twip.robot.kernel import kernel

NAMES = ("a", "b")

class Two(NamedTuple):
    x: float
    y: float

class Pair(NamedTuple):
    y: float
    x: float

class Texts(NamedTuple):
    text: str

@kernel
def difference(two: Two) -> float:
    """Return a difference."""
    return two.x - two.y

@kernel
def helper(x: float) -> float:
    """Return x."""
    return x

@kernel
def again(x: float) -> float:
    """Call itself."""
    return again(x)

@kernel
def untyped(x) -> float:
    """Have no type."""
    return x

@kernel
def write(v: Any) -> float:
    """Write."""
    v.result = 1.0
    return 2.0

@kernel
def initialize(v: Any, time: float) -> None:
    """Do nothing."""
    v.result = 0.0

@kernel
def step(v: Any, time: float, step_size: float) -> None:
    """Break a rule."""
{body}

BLOCK = Block("broken", "Broken", (input("a", None, "in"), output("result", None, "out")), initialize, step)
'''
FIRST = FACE.split("{body}")[0].count("\n") + 1

REFUSED = {
    "v.result = again(v.a)": "again calls itself: kernels have no recursion",
    "v.result = untyped(v.a)": "untyped: x must be annotated",
    "v.result = helper(x=v.a)": "arguments are given by position",
    "v.result = helper(v.a, 1.0)": "helper takes 1 arguments",
    "v.result = v.a + write(v)": "write writes the block's values: call it alone",
    "v.result = helper(write(v))": "write writes the block's values: call it alone",
    "v.result += write(v)": "write writes the block's values: call it alone",
    "v.result = v.a**2": "kernels have the operators + - * /",
    "v.result = sum((v.a, 1.0))": "sum is no kernel",
    "v.result = log(v.a)": "math.log rounds otherwise on every system: from twip.robot.elementary import log",
    "v.result = gamma(v.a)": "gamma is no kernel",
    "v.result = v.other": "the block declares no variable other",
    "v.result = floor(v.a)": "an int where a float is wanted: write float(floor(v.a))",
    "v.result = 0": "an int where a float is wanted",
    "v.result = v.a % 2.0": "// and % divide an integer by a positive integer constant",
    "x = 1.0\nx = (x, x)\nv.result = x[0]": "(x, x) is of type tuple[float, float], where float is wanted",
    "x = (v.a, 1.0)\nv.result = x[int(v.a)]": "the index must be a constant from 0 to 1",
    "if v.a > 0.0:\n    x = 1.0\nv.result = x": "x may not have a value here",
    "for i in range(3):\n    x = 1.0\nv.result = x": "x may not have a value here",
    "for i in range(3):\n    v.result = 1.0 * i\nv.result = 1.0 * i": "i is neither a local name nor a number",
    "for x in (1.0, 2.0):\n    v.result = x": "kernels loop by `for name in range(stop)`",
    "if v.a:\n    v.result = 1.0": "a condition must be a comparison, not of type float",
    "try:\n    v.result = 1.0\nfinally:\n    pass": "kernels have no statement of this kind (Try)",
    "v.result = [1.0][0]": "kernels have no expression of this kind (List)",
    "v.result = 1.0 if v.a > 0.0 else 2": None,
    "v.result = 1.0 if v.a > NAMES else 2.0": "NAMES is neither a local name nor a number of its module",
    "v.result = float(floor(v.a) * floor(v.a))": "a product of two results of floor",
    "v.result = float(99999999999999999999)": "constants of type float, int of 64 bits, and bool only",
    "two = Two(v.a, 1.0)\nv.result = two.z": "two.z: Two has no field z",
    "two = (v.a, 1.0)\nv.result = two.x": "two.x: tuple[float, float] has no field x",
    "v.result = difference((v.a, 1.0))": "(v.a, 1.0) is of type tuple[float, float], where Two is wanted",
    "v.result = difference(Pair(v.a, 1.0))": "Pair(v.a, 1.0) is of type Pair, where Two is wanted",
    "two = Two(v.a, 1.0)\ntwo = Pair(v.a, 1.0)\nv.result = two.x": "Pair(v.a, 1.0) is of type Pair, where Two is",
    "v.result = difference(Two(v.a))": "Two takes 2 arguments",
    "texts = Texts(v.a)\nv.result = 1.0": "Texts: the fields of a NamedTuple are float, int, bool or tuples of these",
    "two = Two(v.a, 1.0)\ntwo.x = 2.0\nv.result = two.x": "two.x: kernels assign floats to the block's values",
    "def inner(): pass": "kernels have no statement of this kind (FunctionDef)",
    "v.result = step": "step is neither a local name nor a number of its module",
    "return v.a": "v.a is of type float, where None is wanted",
}


@pytest.mark.parametrize("body", REFUSED)
def test_what_c_cannot_do_alike_is_refused(body, tmp_path):
    face = tmp_path / "broken.py"
    face.write_text(FACE.replace("{body}", textwrap.indent(body, "    ")), encoding="utf-8")
    block = load_block(face)
    if REFUSED[body] is None:
        assert "? 1.0 : 2.0" in block_source(block)
        return
    with pytest.raises(TwipError) as caught:
        block_source(block)
    (line,) = str(caught.value).splitlines()
    assert REFUSED[body] in line
    assert line.startswith(f"{face}, line ")
    number = int(line.removeprefix(f"{face}, line ").split(":")[0])
    assert number < FIRST + body.count("\n") + 1
    assert "untyped" in body or "again" in body or number >= FIRST


def test_all_functions_are_refused_together(tmp_path):
    face = tmp_path / "broken.py"
    text = FACE.replace("{body}", "    v.result = v.a**2").replace("    v.result = 0.0", "    v.result = 0")
    face.write_text(text, encoding="utf-8")
    with pytest.raises(TwipError) as caught:
        block_source(load_block(face))
    assert len(str(caught.value).splitlines()) == 2


@pytest.mark.parametrize(
    ("sentence", "rule"),
    [
        ('f"{v.a:.3f}"', "numbers are written by :g or :.Ng"),
        ('f"{v.a}"', "a sentence is a constant text or an f-string"),
        ('"a" + str(v.a)', "a sentence is a constant text or an f-string"),
    ],
)
def test_a_sentence_c_cannot_write_is_refused(sentence, rule, tmp_path):
    face = tmp_path / "broken.py"
    rules = f'def check(v: Any) -> list[str]:\n    """Check."""\n    return [{sentence}]\n\nBLOCK'
    text = FACE.replace("{body}", "    v.result = v.a").replace("BLOCK", rules, 1).replace("step)", "step, check)")
    face.write_text(text, encoding="utf-8")
    with pytest.raises(TwipError, match="line") as caught:
        block_source(load_block(face))
    assert rule in str(caught.value)


def test_the_blocks_of_this_folder_are_within_the_subset_but_one():
    for name in ("subset", "typed", "walker"):
        assert f"{name}_model" in block_source(load_block(face_of(name)))
    with pytest.raises(TwipError, match=r"raising\.py, line 18: time % step_size"):
        block_source(load_block(OWN / "raising" / "raising.py"))
