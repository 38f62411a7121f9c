"""The noise generator: published values, exact integers, independent seeds and streams, normal numbers."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from sympy import isprime

from twip.robot.random import M1, M2, next_state, normal_pair, product, remainder, scatter, seeded, uniform

PUBLISHED = {
    1: 0.12701112204657714,
    2: 0.3185275653967945,
    3: 0.3091860155832701,
    4: 0.8258468629271136,
    5: 0.2216299157820229,
    1000: 0.98607848680213228,
    100000: 0.69628910995743587,
}
"""Numbers from the state 12345 six times, by position, as L'Ecuyer's reference implementation gives them."""


def normals(seed, count, stream=1.0):
    state, values = seeded(float(seed), stream), []
    while len(values) < count:
        first, second, *state = normal_pair(*state)
        values += [first, second]
    return np.array(values[:count])


def test_published_numbers():
    state, found = (12345.0,) * 6, {}
    for k in range(1, 100001):
        state = next_state(*state)
        if k in PUBLISHED:
            found[k] = uniform(state[2], state[5])
    assert found == PUBLISHED


def test_equals_the_recurrence_in_integers():
    """The same recurrence in Python's unbounded integers."""
    state = seeded(7.0, 1.0)
    x, y = [int(s) for s in state[:3]], [int(s) for s in state[3:]]
    for _ in range(20000):
        state = next_state(*state)
        x = [*x[1:], (1403580 * x[1] - 810728 * x[0]) % 4294967087]
        y = [*y[1:], (527612 * y[2] - 1370589 * y[0]) % 4294944443]
        assert [*x, *y] == list(state)
        number = (x[2] - y[2]) % 4294967087 or 4294967087
        assert uniform(state[2], state[5]) == number * (1.0 / 4294967088)


@given(st.integers(-(2**53) + int(M1), 2**53 - int(M1)), st.sampled_from([M1, M2]))
def test_remainder_is_exact(value, modulus):
    assert remainder(float(value), modulus) == value % int(modulus)


@given(st.integers(0, int(M2) - 1), st.integers(0, int(M2) - 1), st.sampled_from([M1, M2]))
def test_product_is_exact(a, b, modulus):
    assert product(float(a), float(b), modulus) == a * b % int(modulus)


def test_cubes_are_one_to_one():
    """x -> x**3 permutes the residues of a prime exactly when 3 does not divide the prime minus 1."""
    assert isprime(int(M1))
    assert math.gcd(3, int(M1) - 1) == 1
    word = 123456789
    for i in range(5):
        word = (word + 42 + i) ** 3 % int(M1)
    assert scatter(123456789.0, 42.0, 5) == word


@pytest.mark.parametrize("seed", [0, 1, 2, 2**31 - 1])
@pytest.mark.parametrize("stream", [0, 1, 2])
def test_a_seeded_state_is_valid(seed, stream):
    state = seeded(float(seed), float(stream))
    assert all(Fraction(s).denominator == 1 for s in state)
    assert all(0 <= s < M1 for s in state[:3])
    assert any(state[:3])
    assert all(0 <= s < M2 for s in state[3:])
    assert any(state[3:])


def test_neighbouring_seeds_and_streams_share_nothing():
    states = [seeded(float(seed), float(stream)) for seed in range(200) for stream in range(3)]
    for word in range(6):
        assert len({s[word] for s in states}) == len(states)


def test_neighbouring_seeds_are_uncorrelated():
    """Sequences of a linear generator whose seeds differ linearly obey u0 - 2 u1 + u2 = 0; none such may be left.

    A correlation of independent sequences of length n is normal with deviation 1/sqrt(n): 4 of them leave one in 16
    000.
    """
    n = 20000
    sequences = np.array([normals(seed, n) for seed in (1, 2, 3)] + [normals(1, n, stream=2.0)])
    correlation = np.corrcoef(sequences)
    assert np.all(np.abs(correlation[~np.eye(4, dtype=bool)]) < 4 / math.sqrt(n))
    second_difference = np.var(sequences[0] - 2 * sequences[1] + sequences[2])
    assert second_difference == pytest.approx(6.0, rel=4 * math.sqrt(2 / n))  # 1 + 4 + 1 for independent ones


def test_numbers_are_standard_normal():
    """Mean, variance, shape, independence of 40 000 numbers; bounds are 4 deviations or a level of 0.1 %."""
    n = 40000
    x = normals(1, n)
    assert abs(np.mean(x)) < 4 / math.sqrt(n)
    assert np.var(x) == pytest.approx(1.0, rel=4 * math.sqrt(2 / n))
    assert stats.kstest(x, "norm").pvalue > 1e-3
    for lag in (1, 2, 3, 8, 100):
        assert abs(np.mean(x[lag:] * x[:-lag])) < 4 / math.sqrt(n - lag)
    pairs = x.reshape(-1, 2)
    assert abs(np.mean(pairs[:, 0] ** 2 * pairs[:, 1] ** 2) - 1) < 4 * math.sqrt(8 / len(pairs))  # var(x^2 y^2) = 9 - 1
