"""Computes the constants of twip.robot.elementary with mpmath: minimax polynomials, tables, pieces of pi/2 and ln 2.

python tests/reference/elementary_constants.py      writes src/twip/robot/elementary_constants.py again
"""

from collections.abc import Callable, Iterator
from pathlib import Path

from mpmath import atan, cos, exp, floor, log, lu_solve, matrix, mp, mpf, nint, pi, sin, sqrt

MODULE = Path(__file__).resolve().parents[2] / "src" / "twip" / "robot" / "elementary_constants.py"
Function = Callable[[mpf], mpf]


def to_bits(value: mpf, bits: int) -> float:
    """Return `value` cut to a multiple of 2**-bits, nearest."""
    return float(nint(value * mpf(2) ** bits) / mpf(2) ** bits)


def minimax(f: Function, weight: Function, low: mpf, high: mpf, terms: int) -> list[float]:
    """Return the polynomial with the smallest max |weight (p - f)| on [low, high], by Remez's exchange.

    Coefficients in ascending order. The interval is sampled, its ends included.
    """
    grid = [low + (high - low) * (1 - cos(pi * k / 600)) / 2 for k in range(601)]
    values, weights = [f(x) for x in grid], [weight(x) for x in grid]
    points = [round(600 * (k + 0.5) / (terms + 1)) for k in range(terms + 1)]
    for _ in range(20):
        rows = [[grid[i] ** n for n in range(terms)] + [(-1) ** k / weights[i]] for k, i in enumerate(points)]
        solution = list(lu_solve(matrix(rows), matrix([values[i] for i in points])))
        polynomial = solution[:-1]
        errors = [w * (mp.polyval(polynomial[::-1], x) - y) for x, y, w in zip(grid, values, weights, strict=True)]
        peaks: list[int] = []  # the largest error of each run of one sign
        for i, error in enumerate(errors):
            if peaks and (errors[peaks[-1]] > 0) == (error > 0):
                peaks[-1] = i if abs(error) > abs(errors[peaks[-1]]) else peaks[-1]
            else:
                peaks.append(i)
        while len(peaks) > terms + 1:
            peaks.pop(0 if abs(errors[peaks[0]]) < abs(errors[peaks[-1]]) else -1)
        if peaks == points or len(peaks) < terms + 1:
            break
        points = peaks
    return [float(c) for c in polynomial]


def named(name: str, values: list[float], meaning: str) -> Iterator[str]:
    """Yield the lines of one coefficient after the other, NAME0, NAME1, ..., with what they approximate."""
    yield f"# {meaning}"
    yield from (f"{name}{k} = {value!r}" for k, value in enumerate(values))
    yield ""


def table(name: str, values: list[float], meaning: str) -> Iterator[str]:
    """Yield the lines of a table, with its docstring."""
    yield f"{name} = ("
    line = "   "
    for value in values:
        if len(line) + len(repr(value)) + 2 > 120:
            yield line
            line = "   "
        line += f" {value!r},"
    yield from (line, ")", f'"""{meaning}"""')


def constant(name: str, value: float, meaning: str = "") -> Iterator[str]:
    """Yield the lines of a constant."""
    yield f"{name} = {value!r}"
    if meaning:
        yield f'"""{meaning}"""'


def pieces(value: mpf, *bits: int) -> list[float]:
    """Return floats whose sum is `value`: multiples of 2**-bits each, and the rest."""
    found = [value]
    for number in bits:
        found[-1:] = [mpf(to_bits(found[-1], number)), found[-1] - mpf(to_bits(found[-1], number))]
    return [float(x) for x in found]


def high_low(values: list[mpf], bits: int | None = None) -> tuple[list[float], list[float]]:
    """Return the nearest floats (or multiples of 2**-bits) and the floats nearest to what they leave."""
    high = [float(x) if bits is None else to_bits(x, bits) for x in values]
    return high, [float(x - h) for x, h in zip(values, high, strict=True)]


def trigonometric() -> Iterator[str]:
    """Yield the constants of sin, cos and tan."""
    low, high = mpf(2) ** -40, (pi / 4 * mpf("1.0001")) ** 2
    sine = minimax(lambda z: (sin(sqrt(z)) / sqrt(z) - 1) / z, lambda z: z, low, high, 6)
    yield from named("SIN", sine, "sin x = x + x^3 p(x^2), |x| <= pi/4")
    cosine = minimax(lambda z: (cos(sqrt(z)) - 1 + z / 2) / z**2, lambda z: z**2, low, high, 6)
    yield from named("COS", cosine, "cos x = 1 - x^2/2 + x^4 p(x^2), |x| <= pi/4")
    yield from constant("TWO_OVER_PI", float(2 / pi))
    first, second, third = pieces(pi / 2, 32, 65)
    yield from constant("HALF_PI_FIRST", first)
    yield from constant("HALF_PI_SECOND", second)
    yield from constant("HALF_PI_THIRD", third, "pi/2 in three pieces; the first two have at most 33 bits.")
    (half,), (rest,) = high_low([pi / 2])
    yield from constant("HALF_PI", half)
    yield from constant("HALF_PI_REST", rest, "pi/2 in two pieces.")
    (whole,), (rest,) = high_low([+pi])
    yield from constant("PI", whole)
    yield from constant("PI_REST", rest, "pi in two pieces.")
    with mp.workdps(400):
        digits = [float(floor(2 / pi * mpf(2) ** (24 * k)) % 2**24) for k in range(1, 50)]
    yield from table("TWO_OVER_PI_DIGITS", digits, "2/pi = sum over k = 0, 1, ... of digit k times 2^(-24 (k + 1)).")
    yield ""


def exponential() -> Iterator[str]:
    """Yield the constants of exp."""
    limit = log(2) / 128 * mpf("1.001")
    found = minimax(lambda r: (exp(r) - 1 - r) / r**2, lambda r: r**2, -limit, limit + mpf(2) ** -60, 4)
    yield from named("EXP", found, "e^r = 1 + r + r^2 p(r), |r| <= ln 2/128")
    first, second = pieces(log(2) / 64, 40)
    yield from constant("STEPS_PER_UNIT", float(64 / log(2)))
    yield from constant("STEP_FIRST", first)
    yield from constant("STEP_SECOND", second, "ln 2/64 in two pieces; the first has at most 35 bits.")
    high, low = high_low([mpf(2) ** (mpf(k) / 64) for k in range(64)])
    yield from table("POWER", high, "2^(k/64), k = 0, 1, ..., 63.")
    yield from table("POWER_REST", low, "What `POWER` leaves.")
    yield ""


def logarithm() -> Iterator[str]:
    """Yield the constants of log."""
    inverse = [to_bits(mpf(64) / k, 9) for k in range(45, 92)]
    ends = [(mpf(k) + side) / 64 * c - 1 for k, c in zip(range(45, 92), inverse, strict=True) for side in (-0.5, 0.5)]
    low, high = min(ends), max(ends)
    found = minimax(lambda r: (log(1 + r) - r) / r**2, lambda r: abs(r), low - mpf(2) ** -60, high + mpf(2) ** -61, 7)
    yield from named("LOG", found, f"log(1 + r) = r + r^2 p(r), {float(low):.4f} <= r <= {float(high):.4f}")
    first, second = pieces(log(2), 42)
    yield from constant("LN2_FIRST", first)
    yield from constant("LN2_SECOND", second, "ln 2 in two pieces; the first is a multiple of 2^-42.")
    yield from table("INVERSE", inverse, "64/k to 9 binary places, k = 45, 46, ..., 91.")
    high_part, low_part = high_low([-log(mpf(c)) if c != 1 else mpf(0) for c in inverse], 42)
    yield from table("INVERSE_LOG", high_part, "-ln `INVERSE`, multiples of 2^-42.")
    yield from table("INVERSE_LOG_REST", low_part, "What `INVERSE_LOG` leaves.")
    yield ""


def arctangent() -> Iterator[str]:
    """Yield the constants of atan2."""
    low, high = mpf(2) ** -40, mpf("0.1095") ** 2
    found = minimax(lambda z: (atan(sqrt(z)) / sqrt(z) - 1) / z, lambda z: z, low, high, 7)
    yield from named("ATAN", found, "atan d = d + d^3 p(d^2), |d| <= 7/64")
    high_part, low_part = high_low([atan(mpf(k) / 32) for k in range(33)])
    yield from table("ARC", high_part, "atan(k/32), k = 0, 1, ..., 32.")
    yield from table("ARC_REST", low_part, "What `ARC` leaves.")


def text() -> str:
    """Return the module's text."""
    with mp.workdps(60):
        lines = [*trigonometric(), *exponential(), *logarithm(), *arctangent()]
    return (
        '"""Constants of the elementary functions, written by tests/reference/elementary_constants.py."""\n\n'
        "# fmt: off\n\n" + "\n".join(lines) + "\n"
    )


if __name__ == "__main__":
    MODULE.write_text(text(), encoding="utf-8")
