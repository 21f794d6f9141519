"""From radiance to bytes: vignetting, a wandering gain, blur, noise, saturation.

::

    grey = 255 gain(t) vignette(u, v) (light * psf)                              (1)
    byte = round(clip(grey + N(0, read^2 + shot grey), 0, 255))                  (2)

The point spread is a Gaussian, applied before saturation, as in a lens; motion blur is the mean of the radiance over
the poses of the exposure (``renderer.render``), so the stamp of an image is the middle of its exposure.
"""

import math
from functools import lru_cache

import cv2
import numpy as np

from ....formats.calibration import Calibration
from ....formats.events import Array, Bytes
from ...engine.params import Field, Params
from ..camera import ray_table


class ImagerParams(Params):
    """The imager behind the lens; all zero is a perfect one."""

    exposure_ms: float = Field(5.0, ge=0, description="how long the shutter is open; 0 freezes the motion [ms]")
    blur_samples: int = Field(3, ge=1, le=64, description="poses averaged over one exposure [1]")
    oversampling: int = Field(
        1,
        ge=1,
        le=8,
        description="render so many times finer both ways: borders of walls and posts are smooth, and the lens blurs "
        "before pixels collect [1]",
    )
    psf_px: float = Field(0.5, ge=0, le=20, description="standard deviation of the lens's point spread [px]")
    vignetting: float = Field(0.3, ge=0, lt=1, description="share of light lost in the corners [1]")
    gain: float = Field(1.0, gt=0, description="mean gain [1]")
    gain_sd: float = Field(0.02, ge=0, lt=0.3, description="relative wandering of the gain, over 20 s [1]")
    read_noise_dn: float = Field(1.2, ge=0, description="noise of a black pixel, standard deviation [grey levels]")
    shot_noise_dn: float = Field(0.02, ge=0, description="variance of the noise per grey level [grey levels]")


@lru_cache(maxsize=8)
def vignette(calibration: Calibration, loss: float) -> np.ndarray:
    """Return the share of light that reaches each pixel (H, W): falls with the square of the tangent off the axis."""
    rays = ray_table(calibration)[1:-1, 1:-1]
    r2 = (rays**2).sum(axis=2)
    return np.asarray(1.0 - loss * r2 / r2.max(), np.float32)


def gains(n: int, period_s: float, params: ImagerParams, rng: np.random.Generator) -> Array:
    """Return the gain of each of ``n`` images, (n,): a first-order process around its mean."""
    keep = math.exp(-period_s / 20.0)
    noise = rng.standard_normal(n)
    drift = np.empty(n)
    state = float(rng.standard_normal())
    for i in range(n):
        drift[i] = state
        state = keep * state + math.sqrt(1 - keep * keep) * noise[i]
    return params.gain * np.exp(params.gain_sd * drift)


def photograph(
    light: np.ndarray, gain: float, calibration: Calibration, params: ImagerParams, noise: np.ndarray
) -> Bytes:
    """Turn radiance (H, W), or n times finer (n H, n W), into grey levels (H, W), by eqs. (1), (2).

    The lens blurs before pixels collect. On the pixels themselves a blur leaves edges up to 0.025 px from where they
    are, by where in a pixel that is; on pixels half as wide it is 0.005 px. ``noise`` (H, W) is standard normal.
    """
    from ..kernels import expose

    n = light.shape[0] // calibration.height
    if params.psf_px > 0:
        sigma = n * params.psf_px
        half = max(1, math.ceil(3.5 * sigma))
        light = cv2.GaussianBlur(light, (2 * half + 1, 2 * half + 1), sigma, borderType=cv2.BORDER_REPLICATE)
    if n > 1:
        light = light.reshape(calibration.height, n, calibration.width, n).mean(axis=(1, 3), dtype=np.float32)
    out = np.empty(light.shape, np.uint8)
    shares = vignette(calibration, params.vignetting)
    expose(light, shares, noise, (float(gain), params.read_noise_dn, params.shot_noise_dn), out)
    return out
