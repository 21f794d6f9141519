"""How far apart two sets of lines are, whatever the place they are seen from.

The places of lines in an image row are a projectivity of their abscissae, u = (a X + c) / (b X + 1) (``pose``). Three
lines fit any mark; what more of them leave as a residual tells marks apart. For four lines that is the
cross ratio, eq. (19)::

    CR = (x3 - x2) (x4 - x1) / ((x1 - x2) (x4 - x3)),      sigma(ln |CR|) = sigma_x |grad ln |CR||,

with the lines labelled left to right: it is negative then, and -3 for equal spaces.

Source: the stripe paper, eq. (19); its error is not in the paper.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]


def template_gaps(X: Array, x: Array) -> Array:
    """Return the residuals of the projectivities that fit best, (...): root mean square over the k pairs.

    Linear least squares, then once more with each equation divided by its own denominator, which makes its error that
    of the place.

    Args:
        X: (..., k) abscissae on the mark, increasing; k >= 4.
        x: (..., k) places, increasing; the unit of the result.
    """
    X, x = np.broadcast_arrays(X, x)
    X = _scaled(X)[0]
    x, size = _scaled(x)
    denominator = np.ones_like(x)
    for _ in range(2):
        A = np.stack([X, -x * X, np.ones_like(x)], axis=-1) / denominator[..., None]
        q, r = np.linalg.qr(A)
        right = np.einsum("...ki,...k->...i", q, x / denominator)
        abc = np.linalg.solve(r, right[..., None])[..., 0]
        denominator = abc[..., 1:2] * X + 1.0
        # Where lines would lie behind the camera the fit is none, and the first guess stands.
        denominator = np.where(np.all(denominator > 0.1, axis=-1, keepdims=True), denominator, 1.0)
    fitted = (abc[..., 0:1] * X + abc[..., 2:3]) / denominator
    return np.asarray(np.sqrt(np.mean((fitted - x) ** 2, axis=-1)) * size[..., 0])


def log_cross_ratios(x: Array) -> Array:
    """Return ln |CR| (..., 4) -> (...) of four places, left to right; eq. (19)."""
    x1, x2, x3, x4 = np.moveaxis(x, -1, 0)
    return np.asarray(np.log((x3 - x2) * (x4 - x1) / ((x2 - x1) * (x4 - x3))))


def cross_ratio_sigma(x: Array, sigma: float) -> Array:
    """Return the standard deviation of ``log_cross_ratios`` where each place has the error ``sigma``."""
    x1, x2, x3, x4 = np.moveaxis(x, -1, 0)
    inner, outer, left, right = 1 / (x3 - x2), 1 / (x4 - x1), 1 / (x2 - x1), 1 / (x4 - x3)
    gradient = np.stack([left - outer, -inner - left, inner + right, outer - right])
    return np.asarray(sigma * np.sqrt((gradient**2).sum(axis=0)))


def _scaled(values: Array) -> tuple[Array, Array]:
    middle = values - values.mean(axis=-1, keepdims=True)
    size = np.abs(middle).max(axis=-1, keepdims=True)
    return middle / size, size
