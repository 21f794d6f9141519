"""How long a call takes, for benchmarks that compare methods within one run."""

import time
from collections.abc import Callable

import numpy as np


def mean_time(call: Callable[[np.ndarray], object], arrays: list[np.ndarray]) -> float:
    """Return the mean processor time of a call [s]; each array is copied to the same place first, untimed."""
    place = np.empty(max(array.size for array in arrays), np.uint8)
    total = 0.0
    for array in arrays:
        here = place[: array.size].reshape(array.shape)
        np.copyto(here, array)
        start = time.process_time()
        call(here)
        total += time.process_time() - start
    return total / len(arrays)
