"""Mean, spread and confidence of a few repeated runs.

The standard deviation divides by n - 1; the interval is Student's: mean +- t(n - 1, 0.975) sd / sqrt(n). With one
run there is neither, and both are ``None`` rather than zero.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """What a table cell carries.

    Attributes:
        n: number of values.
        mean: None when n = 0.
        sd: with n - 1; None when n < 2.
        low, high: 95 % interval of the mean; None when n < 2.
    """

    n: int
    mean: float | None = None
    sd: float | None = None
    low: float | None = None
    high: float | None = None


def spread(values: Iterable[float]) -> Spread:
    """Describe repeated values of one quantity.

    Raises:
        ValueError: a value is not finite.
    """
    x = [float(value) for value in values]
    if not all(math.isfinite(value) for value in x):
        raise ValueError(f"cannot average {x!r}: a value is not finite")
    n = len(x)
    if n == 0:
        return Spread(n=0)
    mean = math.fsum(x) / n
    if n == 1:
        return Spread(n=1, mean=mean)
    from scipy.stats import t  # slow to load, and only tables need it

    sd = math.sqrt(math.fsum((value - mean) ** 2 for value in x) / (n - 1))
    half = float(t.ppf(0.975, n - 1)) * sd / math.sqrt(n)
    return Spread(n=n, mean=mean, sd=sd, low=mean - half, high=mean + half)
