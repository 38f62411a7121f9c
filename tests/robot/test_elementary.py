"""The elementary functions against mpmath, at special values, and compiled."""

import importlib.util
import math
import struct
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path
from random import Random

import mpmath
import numba
import numpy as np
import pytest
from mpmath import mp, mpf

from twip.robot import elementary, elementary_constants, kernel
from twip.robot.angle_reduction import reduced, reduced_exactly

NAMES = ("sin", "cos", "tan", "atan2", "exp", "log")
BOUND = 0.8
"""Largest error allowed, in units in the last place of the true value rounded."""
FEW, MANY = 1_000, 250_000
"""Draws of the default and of the heavy test; a draw is four arguments."""
INF, NAN, TINY, HUGE = math.inf, math.nan, 5e-324, 1.7976931348623157e308


def bits(x: float) -> int:
    """Return the bits of a double; all nan are one."""
    return int(struct.unpack("<q", struct.pack("<d", x))[0]) if x == x else -1


def spread(rng: Random, low: float, high: float) -> float:
    """Return a number of either sign whose decimal logarithm is even between `low` and `high`."""
    return math.copysign(10 ** rng.uniform(low, high), rng.random() - 0.5)


def drawn(name: str, rng: Random) -> list[tuple[float, ...]]:
    """Return four arguments: usual ones, those where an algorithm changes over, and the whole range."""
    if name == "exp":
        return [(x,) for x in (rng.uniform(-1, 1), spread(rng, -20, 2.85), rng.uniform(-745, 709.7), rng.gauss(0, 40))]
    if name == "log":
        near_1 = 1.0 + spread(rng, -16, -1.5)
        return [(x,) for x in (rng.uniform(0.4, 3.0), near_1, abs(spread(rng, -323, 308)), rng.uniform(0.98, 1.02))]
    if name == "atan2":
        y, x, power = rng.uniform(-1, 1), rng.uniform(-1, 1), 2.0 ** rng.randint(-30, 30)
        small = rng.uniform(-0.14, 0.14)
        return [
            (y, x),
            (y * power, x),
            (small, rng.uniform(0.9, 1.1)),
            (spread(rng, -320, 308), spread(rng, -320, 308)),
        ]
    return [(x,) for x in (rng.uniform(-0.8, 0.8), rng.uniform(-10, 10), spread(rng, -20, 6), spread(rng, 5, 308))]


def true_value(name: str, arguments: tuple[float, ...]) -> mpf:
    """Return the function's value to at least 120 bits."""
    exponent = max((math.frexp(x)[1] for x in arguments), default=0)
    with mp.workprec(130 + (max(0, exponent) if name in ("sin", "cos", "tan") else 0)):
        return getattr(mpmath, name)(*map(mpf, arguments))


def error(name: str, arguments: tuple[float, ...]) -> float:
    """Return the error in units in the last place; infinite for a wrong sign or a value where none should be."""
    true, found = true_value(name, arguments), getattr(elementary, name)(*arguments)
    nearest = float(true)
    if math.copysign(1.0, nearest) != math.copysign(1.0, found) or not math.isfinite(found):
        return INF
    with mp.workprec(130):
        return float(abs(mpf(found) - true) / mpf(math.ulp(nearest)))


def worst(name: str, draws: int) -> tuple[float, tuple[float, ...]]:
    """Return the largest error over random arguments, and the arguments."""
    rng = Random(name)
    return max((error(name, arguments), arguments) for _ in range(draws) for arguments in drawn(name, rng))


@pytest.mark.parametrize("name", NAMES)
def test_errors_are_below_the_bound(name: str) -> None:
    assert worst(name, FEW)[0] < BOUND


@pytest.mark.heavy
@pytest.mark.parametrize("name", NAMES)
def test_errors_of_a_million_arguments_are_below_the_bound(name: str) -> None:
    largest, arguments = worst(name, MANY)
    print(f"{name}: {largest:.4f} at {arguments}")
    assert largest < BOUND


def nearest_multiples() -> Iterator[float]:
    """Yield for each power of two the doubles that come nearest to multiples of pi/2.

    The mantissas are denominators of the convergents of 2^e / (pi/2), and multiples of them.
    """
    with mp.workprec(1400):
        for exponent in range(-52, 971):
            rest = mpf(2) ** exponent / (mp.pi / 2)
            before, q = 0, 1
            while True:
                whole = int(mp.floor(rest))
                rest = 1 / (rest - whole) if rest != whole else mpf(2) ** 200
                before, q = q, int(mp.floor(rest)) * q + before
                if q >= 2**53:
                    break
            yield math.ldexp(float(before), exponent)
            yield math.ldexp(float((2**53 - 1) // before * before), exponent)


@pytest.mark.parametrize("name", ["sin", "cos", "tan"])
def test_angles_nearest_to_multiples_of_a_quarter_turn(name: str) -> None:
    angles = list(nearest_multiples())
    assert min(abs(math.remainder(x, math.pi / 2)) for x in angles) < 1e-15
    assert max(error(name, (x,)) for x in angles) < BOUND
    doubles = [k * math.pi / 2 for k in range(1, 400)]
    assert max(error(name, (x * sign,)) for x in doubles for sign in (1.0, -1.0)) < BOUND


@pytest.mark.parametrize("x", [1.0, 2.0, -3.9, 10.0, 12345.678, -999999.0])
def test_both_reductions_agree(x: float) -> None:
    quarter, rest, tail = reduced(x)
    other, other_rest, other_tail = reduced_exactly(x)
    assert math.cos(quarter * math.pi) == math.cos(other * math.pi)
    assert rest + tail == other_rest + other_tail
    assert abs(rest) <= math.pi / 4 + 1e-9
    assert abs(tail - other_tail) <= 2.0**-100


def test_a_reduction_keeps_within_the_table() -> None:
    for x in (HUGE, -HUGE, 2.0**1023, 1e6, TINY):
        assert abs(reduced_exactly(x)[1]) <= math.pi / 4 + 1e-9


SPECIAL: dict[str, list[tuple[float, ...]]] = {
    "sin": [(0.0, 0.0), (-0.0, -0.0), (TINY, TINY), (-1e-300, -1e-300), (INF, NAN), (-INF, NAN), (NAN, NAN)],
    "cos": [(0.0, 1.0), (-0.0, 1.0), (TINY, 1.0), (1e-9, 1.0), (INF, NAN), (-INF, NAN), (NAN, NAN)],
    "tan": [(0.0, 0.0), (-0.0, -0.0), (TINY, TINY), (-1e-310, -1e-310), (INF, NAN), (-INF, NAN), (NAN, NAN)],
    "exp": [
        (0.0, 1.0), (-0.0, 1.0), (TINY, 1.0), (INF, INF), (-INF, 0.0), (math.nextafter(709.782712893384, INF), INF),
        (709.782712893384, 1.7976931348622732e308), (-708.3964185322641, 2.2250738585072626e-308),
        (-745.1332191019411, TINY), (-745.1332191019412, 0.0), (-746.0, 0.0), (-HUGE, 0.0), (HUGE, INF), (NAN, NAN),
    ],
    "log": [
        (1.0, 0.0), (0.0, -INF), (-0.0, -INF), (INF, INF), (-INF, NAN), (-1.0, NAN), (-TINY, NAN), (NAN, NAN),
        (TINY, -744.4400719213812), (HUGE, 709.782712893384), (2.0, math.log(2.0)),
        (1.0 + 2.0**-52, 2.2204460492503128e-16),
    ],
    "atan2": [
        (0.0, 0.0, 0.0), (-0.0, 0.0, -0.0), (0.0, -0.0, math.pi), (-0.0, -0.0, -math.pi), (0.0, 1.0, 0.0),
        (-0.0, 1.0, -0.0), (0.0, -1.0, math.pi), (-0.0, -1.0, -math.pi), (TINY, -0.0, math.pi / 2), (NAN, 1.0, NAN),
        (1.0, NAN, NAN), (NAN, INF, NAN), (TINY, HUGE, 0.0), (-TINY, HUGE, -0.0), (TINY, -HUGE, math.pi),
        (HUGE, TINY, math.pi / 2), (TINY, TINY, math.pi / 4), (HUGE, HUGE, math.pi / 4), (-HUGE, HUGE, -math.pi / 4),
    ],
}  # fmt: skip
"""Arguments and the value to the last bit: as IEEE 754 defines it, or the double nearest to the true value."""


@pytest.mark.parametrize("name", NAMES)
def test_special_values(name: str) -> None:
    function: Callable[..., float] = getattr(elementary, name)
    for *arguments, expected in SPECIAL[name]:
        assert bits(function(*arguments)) == bits(expected), arguments


@pytest.mark.parametrize(
    ("y", "x"), list(product([INF, -INF, 1.0, -1.0, 0.0, -0.0], [INF, -INF, 2.5, -2.5, 0.0, -0.0]))
)
def test_arctangent_in_all_quadrants(y: float, x: float) -> None:
    """The library's values of these are the nearest doubles, for infinities and zeros by its specification."""
    assert elementary.atan2(y, x) == pytest.approx(math.atan2(y, x), rel=2e-16, abs=0.0)
    assert math.copysign(1.0, elementary.atan2(y, x)) == math.copysign(1.0, math.atan2(y, x))
    if 0.0 in (x, y) or math.isinf(x) or math.isinf(y):
        assert bits(elementary.atan2(y, x)) == bits(math.atan2(y, x))


@pytest.mark.parametrize("name", ["exp", "log"])
def test_subnormal_numbers(name: str) -> None:
    rng = Random(5)
    values = [-708.4 - 36.6 * rng.random() for _ in range(300)] if name == "exp" else [0.0]
    values += [rng.getrandbits(rng.randint(1, 52)) * TINY for _ in range(300)]
    assert max(error(name, (x,)) for x in values if x) < BOUND


def sample() -> list[float]:
    """Return arguments of all kinds for comparisons of two ways to compute the same."""
    rng = Random(11)
    drawn_ones = [x for _ in range(150) for name in ("sin", "exp", "log") for (x,) in drawn(name, rng)]
    return [
        *drawn_ones,
        *(-x for x in drawn_ones),
        0.0,
        -0.0,
        INF,
        -INF,
        NAN,
        TINY,
        HUGE,
        *list(nearest_multiples())[::9],
    ]


def test_sine_and_cosine_together_are_those_alone() -> None:
    for x in sample():
        across, along = elementary.sin_cos(x)
        assert (bits(across), bits(along)) == (bits(elementary.sin(x)), bits(elementary.cos(x)))


def test_symmetries() -> None:
    for x in sample():
        for name in ("sin", "tan"):
            function = getattr(elementary, name)
            assert bits(function(-x)) == bits(-function(x))
        assert bits(elementary.cos(-x)) == bits(elementary.cos(x))


@pytest.mark.parametrize("name", [*NAMES, "sin_cos"])
def test_compiled_and_plain_give_the_same_bits(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(kernel, "numba", numba, raising=False)
    monkeypatch.setattr(kernel, "_twins", {})
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    function = getattr(elementary, name)
    twin = kernel.compiled(function)
    values = sample()
    others = values[::-1]
    if name == "atan2":
        both = numba.njit(lambda ys, xs: np.array([twin(ys[i], xs[i]) for i in range(len(ys))]))
        found, expected = both(np.array(values), np.array(others)), list(map(function, values, others))
    elif name == "sin_cos":
        both = numba.njit(lambda xs: np.array([twin(x)[1] + 2.0 * twin(x)[0] for x in xs]))
        found, expected = both(np.array(values)), [c + 2.0 * s for s, c in map(function, values)]
    else:
        found, expected = (
            numba.njit(lambda xs: np.array([twin(x) for x in xs]))(np.array(values)),
            map(function, values),
        )
    assert [bits(x) for x in found] == [bits(x) for x in expected]


def test_constants_are_those_that_the_script_computes() -> None:
    path = Path(__file__).resolve().parents[1] / "reference" / "elementary_constants.py"
    spec = importlib.util.spec_from_file_location("elementary_constants_script", path)
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert Path(elementary_constants.__file__).read_text(encoding="utf-8") == script.text()
