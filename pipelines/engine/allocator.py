"""Keeps image-sized buffers in the process instead of giving them back to the kernel at every free.

With glibc's defaults each OpenCV call page-faults its output anew: 2 to 6 times slower on images and on decompression.
"""

import ctypes
import sys

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3


def keep_buffers() -> bool:
    """Raise glibc's thresholds once, before the first big allocation; False where there is no glibc."""
    if not sys.platform.startswith("linux"):
        return False
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):
        return False
    return bool(mallopt(M_MMAP_THRESHOLD, 32 << 20)) and bool(mallopt(M_TRIM_THRESHOLD, 512 << 20))
