"""Cameras: from directions to pixels and exactly back, for the lens models of ``camera_info``.

A direction (X, Y, Z) in the optical frame (x right, y down, z along the view) is normalised to x = X/Z, y = Y/Z,
distorted, and scaled to pixels: u = fx x' + cx, v = fy y' + cy; pixel centres are integers. With s = x^2 + y^2:

- ``plumb_bob`` (k1 k2 p1 p2 k3) and ``rational_polynomial`` (k1 k2 p1 p2 k3 k4 k5 k6):
  x' = x g + 2 p1 x y + p2 (s + 2 x^2),  y' = y g + p1 (s + 2 y^2) + 2 p2 x y,
  g = (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3);
- ``equidistant`` (k1 k2 k3 k4): with t = atan(sqrt(s)), x' = x d(t) / sqrt(s),
  d(t) = t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8).

The inverse is Newton's method with the analytic Jacobian. Outside the disc in which the radial function grows (where
two directions would share a pixel) both ways give nan.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

_COEFFICIENTS = {"plumb_bob": (0, 4, 5), "rational_polynomial": (0, 8), "equidistant": (0, 4)}

_MOST_STEPS = 30
"""Newton steps of the inverse; four are usual."""


@dataclass(frozen=True)
class Camera:
    """One camera, made from plain numbers; hashable, so that tables made from it can be cached.

    Attributes:
        fx, fy, cx, cy: focal lengths and principal point [px].
        model: ``plumb_bob``, ``rational_polynomial`` or ``equidistant``.
        distortion: the model's coefficients; empty for none.

    Raises:
        ValueError: a focal length that is not positive, an unknown model, or a wrong number of coefficients.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    model: str = "plumb_bob"
    distortion: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what no camera has."""
        if not (self.fx > 0 and self.fy > 0):
            raise ValueError(f"the focal lengths are fx={self.fx!r}, fy={self.fy!r} px; both must be positive")
        if self.model not in _COEFFICIENTS:
            raise ValueError(f"unknown distortion model {self.model!r}; known: {', '.join(_COEFFICIENTS)}")
        if len(self.distortion) not in _COEFFICIENTS[self.model]:
            counts = " or ".join(str(n) for n in _COEFFICIENTS[self.model])
            raise ValueError(f"{self.model} takes {counts} coefficients, not {len(self.distortion)}")
        if not np.all(np.isfinite([self.fx, self.fy, self.cx, self.cy, *self.distortion])):
            raise ValueError("a number of the calibration is not finite")

    def project(self, directions: Array) -> Array:
        """Map directions (..., 3) in the optical frame to pixels (..., 2); nan behind the camera.

        The directions need not have unit length.
        """
        directions = np.asarray(directions, dtype=np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            xy = directions[..., :2] / directions[..., 2:]
        xy = np.where(directions[..., 2:] > 0, xy, np.nan)
        return self.distort(xy) * (self.fx, self.fy) + (self.cx, self.cy)

    def unproject(self, uv: Array) -> Array:
        """Map pixels (..., 2) to directions (..., 3) in the optical frame, scaled to Z = 1."""
        uv = np.asarray(uv, dtype=np.float64)
        xy = self.undistort((uv - (self.cx, self.cy)) / (self.fx, self.fy))
        return np.concatenate([xy, np.ones_like(xy[..., :1])], axis=-1)

    def unproject_with_jacobian(self, uv: Array) -> tuple[Array, Array]:
        """Return ``unproject`` (..., 3) and its derivative d(x, y)/d(u, v) (..., 2, 2) [1/px]."""
        directions = self.unproject(uv)
        forward = self.distort_jacobian(directions[..., :2]) * np.array([[self.fx], [self.fy]])
        return directions, _inverse(forward)

    def distort(self, xy: Array) -> Array:
        """Map ideal normalised coordinates (..., 2) to the distorted ones (..., 2)."""
        xy = np.asarray(xy, dtype=np.float64)
        if self.is_pinhole:
            return xy.copy()
        inside = (xy**2).sum(-1, keepdims=True) <= self._limit
        return np.where(inside, self._forward(np.where(inside, xy, 0.0))[0], np.nan)

    def distort_jacobian(self, xy: Array) -> Array:
        """Return d(x', y')/d(x, y) (..., 2, 2) of ``distort``."""
        return self._forward(np.asarray(xy, dtype=np.float64))[1]

    def undistort(self, xy: Array) -> Array:
        """Map distorted coordinates (..., 2) to ideal ones, exact to rounding; nan where no direction leads there."""
        target = np.asarray(xy, dtype=np.float64)
        if self.is_pinhole:
            return target.copy()
        if self.model == "equidistant":
            return self._undistort_equidistant(target)
        # The distorted point is near enough to start from; far outside, start at the edge of the valid disc.
        radius = np.sqrt((target**2).sum(-1, keepdims=True))
        edge = np.sqrt(self._limit)
        guess = target * np.minimum(1.0, 0.99 * edge / np.maximum(radius, 1e-300))
        with np.errstate(all="ignore"):
            for _ in range(_MOST_STEPS):
                value, jacobian = self._forward(guess)
                step = _solve(jacobian, value - target)
                length = np.sqrt((step**2).sum(-1, keepdims=True))
                if not np.any(length > 1e-3):  # near: full steps, and the next but one would be 1e-12
                    guess = guess - step
                    if not np.any(length > 1e-9):
                        break
                    continue
                guess = guess - step * np.minimum(1.0, 0.25 / np.maximum(length, 1e-300))
                size = np.sqrt((guess**2).sum(-1, keepdims=True))
                guess = guess * np.minimum(1.0, edge / np.maximum(size, 1e-300))
            error = np.abs(self._forward(guess)[0] - target).max(-1, keepdims=True)
            is_inside = (guess**2).sum(-1, keepdims=True) <= self._limit * (1 + 1e-12)
        return np.where(is_inside & (error < 1e-12 * (1.0 + radius)), guess, np.nan)

    @cached_property
    def is_pinhole(self) -> bool:
        """Whether the lens bends nothing; calibrations of such cameras have coefficients of zero as well as none."""
        return self.model != "equidistant" and not any(self.distortion)

    @cached_property
    def _limit(self) -> float:
        """Largest s = x^2 + y^2 up to which the radial function grows."""
        if self.model == "equidistant":
            k = (*self.distortion, 0.0, 0.0, 0.0, 0.0)[:4]
            slope = np.polynomial.Polynomial([1.0, 3 * k[0], 5 * k[1], 7 * k[2], 9 * k[3]])  # d'(t) in t^2
            t = np.sqrt(_first_positive_root(slope))
            return float(np.tan(t) ** 2) if t < np.pi / 2 else np.inf
        numerator, denominator = self._radial
        s = np.polynomial.Polynomial([0.0, 1.0])
        slope = (numerator + 2 * s * numerator.deriv()) * denominator - 2 * s * numerator * denominator.deriv()
        return min(_first_positive_root(slope), _first_positive_root(denominator))

    @cached_property
    def _radial(self) -> tuple[np.polynomial.Polynomial, np.polynomial.Polynomial]:
        """Numerator and denominator of g as polynomials of s."""
        k1, k2, _, _, k3, k4, k5, k6 = (*self.distortion, *(0.0,) * 8)[:8]
        return np.polynomial.Polynomial([1.0, k1, k2, k3]), np.polynomial.Polynomial([1.0, k4, k5, k6])

    def _forward(self, xy: Array) -> tuple[Array, Array]:
        """Return the distorted coordinates and their Jacobian, without the check of the valid disc."""
        x, y = xy[..., 0], xy[..., 1]
        s = x * x + y * y
        if self.model == "equidistant":
            g, dg = self._equidistant_scale(s)
            p1 = p2 = 0.0
        else:
            k1, k2, p1, p2, k3, k4, k5, k6 = (*self.distortion, *(0.0,) * 8)[:8]
            n, d = 1 + s * (k1 + s * (k2 + s * k3)), 1 + s * (k4 + s * (k5 + s * k6))
            dn, dd = k1 + s * (2 * k2 + s * 3 * k3), k4 + s * (2 * k5 + s * 3 * k6)
            g, dg = n / d, (dn * d - n * dd) / (d * d)  # dg/ds
        value, jacobian = np.empty_like(xy), np.empty((*xy.shape, 2))
        value[..., 0] = x * g + 2 * p1 * x * y + p2 * (s + 2 * x * x)
        value[..., 1] = y * g + p1 * (s + 2 * y * y) + 2 * p2 * x * y
        jacobian[..., 0, 0] = g + 2 * x * x * dg + 2 * p1 * y + 6 * p2 * x
        jacobian[..., 1, 1] = g + 2 * y * y * dg + 6 * p1 * y + 2 * p2 * x
        jacobian[..., 0, 1] = jacobian[..., 1, 0] = 2 * x * y * dg + 2 * p1 * x + 2 * p2 * y
        return value, jacobian

    def _equidistant_scale(self, s: Array) -> tuple[Array, Array]:
        """Return g = d(t) / sqrt(s) and dg/ds of the equidistant model."""
        k1, k2, k3, k4 = (*self.distortion, *(0.0,) * 4)[:4]
        r = np.sqrt(s)
        t = np.arctan(r)
        t2 = t * t
        d = t * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
        slope = 1 + t2 * (3 * k1 + t2 * (5 * k2 + t2 * (7 * k3 + t2 * 9 * k4)))
        is_near = s < 1e-6
        safe = np.where(is_near, 1.0, r)
        # Near the axis: atan r = r - r^3/3 + r^5/5, so g = 1 + (k1 - 1/3) s + (1/5 - k1 + k2) s^2.
        g = np.where(is_near, 1 + (k1 - 1 / 3) * s + (0.2 - k1 + k2) * s * s, d / safe)
        far = (slope / (1 + s) - d / safe) / (2 * safe * safe)
        return g, np.where(is_near, (k1 - 1 / 3) + 2 * (0.2 - k1 + k2) * s, far)

    def _undistort_equidistant(self, target: Array) -> Array:
        """Solve d(t) = |x'| for the angle t from the axis, then put it back on the ray of x'."""
        k1, k2, k3, k4 = (*self.distortion, *(0.0,) * 4)[:4]
        length = np.sqrt((target**2).sum(-1, keepdims=True))
        edge = np.arctan(np.sqrt(self._limit))
        t = np.minimum(length, edge)
        for _ in range(_MOST_STEPS):
            t2 = t * t
            d = t * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
            slope = 1 + t2 * (3 * k1 + t2 * (5 * k2 + t2 * (7 * k3 + t2 * 9 * k4)))
            new = np.clip(t - (d - length) / np.maximum(slope, 1e-6), 0.0, edge)
            is_done = np.all(np.abs(new - t) <= 1e-16 + 1e-15 * t)
            t = new
            if is_done:
                break
        t2 = t * t
        is_met = np.abs(t * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4)))) - length) < 1e-12
        is_met &= t < np.pi / 2 - 1e-9
        scale = np.where(length > 1e-12, np.tan(np.where(is_met, t, 0.0)) / np.maximum(length, 1e-12), 1.0)
        return np.where(is_met, target * scale, np.nan)


def _first_positive_root(polynomial: np.polynomial.Polynomial) -> float:
    roots = polynomial.trim(1e-12).roots()  # a coefficient that small moves no root that matters
    real = roots[np.abs(roots.imag) < 1e-12 * (1 + np.abs(roots))].real
    positive = real[real > 0]
    return float(positive.min()) if len(positive) else float(np.inf)


def _inverse(matrix: Array) -> Array:
    """Invert (..., 2, 2) matrices."""
    a, b, c, d = matrix[..., 0, 0], matrix[..., 0, 1], matrix[..., 1, 0], matrix[..., 1, 1]
    result = np.empty_like(matrix)
    result[..., 0, 0], result[..., 0, 1], result[..., 1, 0], result[..., 1, 1] = d, -b, -c, a
    result /= (a * d - b * c)[..., None, None]
    return result


def _solve(matrix: Array, vector: Array) -> Array:
    """Solve (..., 2, 2) x = (..., 2)."""
    a, b, c, d = matrix[..., 0, 0], matrix[..., 0, 1], matrix[..., 1, 0], matrix[..., 1, 1]
    p, q = vector[..., 0], vector[..., 1]
    result = np.empty_like(vector)
    determinant = a * d - b * c
    result[..., 0] = (d * p - b * q) / determinant
    result[..., 1] = (a * q - c * p) / determinant
    return result
