"""Normal equations of a chain: each state touches its neighbours, and a border of few unknowns touches them all.

::

    [ A   B ] [x]   [g]      A: N diagonal blocks (d, d), and N - 1 blocks below them at (i + 1, i)
    [ B'  C ] [b] = [h]      B: (N d, q), C: (q, q)

    A = L L',  Y = A^-1 B,  S = C - B' Y                   banded Cholesky, Schur complement of the border
    b = S^-1 (h - Y' g),   x = A^-1 g - Y b

L has blocks L_i on its diagonal and M_i at (i + 1, i). The covariance of every state is a block on the diagonal of the
inverse, found from the last one backwards, without the rest of the inverse::

    G_i = L_i^-T M_i',   Sigma_i = (L_i L_i')^-1 + G_i Sigma_{i+1} G_i',   then  Sigma_i + Y_i S^-1 Y_i'

All of it is O(N) in time and memory (N d q numbers for the border).
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]


@dataclass(slots=True, eq=False)
class Normal:
    """Normal equations to be filled.

    Attributes:
        diagonal: (N, d, d) blocks of A on the diagonal.
        below: (N - 1, d, d) blocks of A at (i + 1, i).
        border: (N, d, q) B.
        corner: (q, q) C.
        right: (N, d) g.
        right_border: (q,) h.
    """

    diagonal: Array
    below: Array
    border: Array
    corner: Array
    right: Array
    right_border: Array

    @classmethod
    def zero(cls, n: int, d: int, q: int) -> "Normal":
        """Return empty ones: n >= 1 states of d >= 1 unknowns, q >= 0 in the border."""
        return cls(
            diagonal=np.zeros((n, d, d)),
            below=np.zeros((n - 1, d, d)),
            border=np.zeros((n, d, q)),
            corner=np.zeros((q, q)),
            right=np.zeros((n, d)),
            right_border=np.zeros(q),
        )


class Factorised:
    """Normal equations, ready to be solved."""

    def __init__(self, normal: Normal, damping: float = 0.0) -> None:
        """Factorise.

        Args:
            normal: the equations.
            damping: part of the diagonal that is added to it (Marquardt).

        Raises:
            ValueError: a state, or an unknown of the border, is not determined.
        """
        from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

        n, d, q = normal.border.shape
        self.n, self.d, self.q = n, d, q
        band = _band(normal.diagonal, normal.below)
        band[0] *= 1.0 + damping
        try:
            self._factor = cholesky_banded(band, lower=True, overwrite_ab=True, check_finite=False)
        except LinAlgError:
            raise ValueError("the measurements do not determine every state. Add a weak prior.") from None
        self._solve_banded = cho_solve_banded
        self._Y = self._states(normal.border.reshape(n * d, q)) if q else np.zeros((n * d, 0))
        schur = normal.corner - normal.border.reshape(n * d, q).T @ self._Y
        schur[np.diag_indices(q)] += damping * np.diag(normal.corner)
        try:
            self._schur = np.linalg.inv(np.linalg.cholesky(0.5 * (schur + schur.T)))
        except np.linalg.LinAlgError:
            raise ValueError("the measurements do not determine the border. Add a weak prior.") from None

    def solve(self, right: Array, right_border: Array) -> tuple[Array, Array]:
        """Return x (N, d) and b (q,) for right sides g (N, d) and h (q,)."""
        g = right.reshape(-1)
        b = self._schur.T @ (self._schur @ (right_border - self._Y.T @ g))
        x = self._states(g) - self._Y @ b
        return x.reshape(self.n, self.d), b

    def marginals(self) -> tuple[Array, Array]:
        """Return the covariances of the states (N, d, d) and of the border (q, q)."""
        L, M = self._blocks()
        inverse = np.linalg.inv(L)
        own = np.swapaxes(inverse, 1, 2) @ inverse
        gain = np.swapaxes(inverse[:-1], 1, 2) @ np.swapaxes(M, 1, 2)
        sigma = np.empty_like(own)
        sigma[-1] = last = own[-1]
        for i in range(self.n - 2, -1, -1):
            G = gain[i]
            sigma[i] = last = own[i] + G @ last @ G.T
        if self.q:
            half = (self._Y @ self._schur.T).reshape(self.n, self.d, self.q)
            sigma += half @ np.swapaxes(half, 1, 2)
        return 0.5 * (sigma + np.swapaxes(sigma, 1, 2)), self._schur.T @ self._schur

    def _states(self, right: Array) -> Array:
        """Return A^-1 times (N d,) or (N d, k)."""
        return np.asarray(self._solve_banded((self._factor, True), right, check_finite=False))

    def _blocks(self) -> tuple[Array, Array]:
        """Return the blocks L_i (N, d, d) and M_i (N - 1, d, d) of the Cholesky factor."""
        n, d = self.n, self.d
        L, M = np.zeros((n, d, d)), np.zeros((n - 1, d, d))
        for a in range(d):
            for b in range(d):
                if a >= b:
                    L[:, a, b] = self._factor[a - b, b::d]
                if n > 1:
                    M[:, a, b] = self._factor[d + a - b, b : (n - 1) * d : d]
        return L, M


def _band(diagonal: Array, below: Array) -> Array:
    """Return A as LAPACK wants it: element (i, j), i >= j, at [i - j, j]."""
    n, d = diagonal.shape[:2]
    band = np.zeros((2 * d if n > 1 else d, n * d))
    for a in range(d):
        for b in range(d):
            if a >= b:
                band[a - b, b::d] = diagonal[:, a, b]
            if n > 1:
                band[d + a - b, b : (n - 1) * d : d] = below[:, a, b]
    return band
