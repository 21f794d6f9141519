"""Compile a kernel with numba: once per machine, without the interpreter lock, also where nothing can be cached."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit, types

F = TypeVar("F", bound=Callable[..., object])

# Pixels of events are read-only; a writable array passes for a read-only one, never the other way round.
U8_2D = types.Array(types.uint8, 2, "C", readonly=True)
U8_1D = types.Array(types.uint8, 1, "C")
U16_2D = types.Array(types.uint16, 2, "C")
F64_1D = types.Array(types.float64, 1, "C")
F64_2D = types.Array(types.float64, 2, "C")
F64_1D_IN = types.Array(types.float64, 1, "C", readonly=True)
F64_2D_IN = types.Array(types.float64, 2, "C", readonly=True)
F64_3D_IN = types.Array(types.float64, 3, "C", readonly=True)
I64_1D = types.Array(types.int64, 1, "C")
I64_1D_IN = types.Array(types.int64, 1, "C", readonly=True)
F32_1D = types.Array(types.float32, 1, "C")
F32_1D_IN = types.Array(types.float32, 1, "C", readonly=True)
F32_3D_IN = types.Array(types.float32, 3, "C", readonly=True)
I32_1D = types.Array(types.int32, 1, "C")
I32_2D = types.Array(types.int32, 2, "C")


def floats(n: int) -> Any:
    """Return the type of a tuple of n float64."""
    return types.UniTuple(types.float64, n)  # type: ignore[no-untyped-call]


def ints(n: int) -> Any:
    """Return the type of a tuple of n int64."""
    return types.UniTuple(types.int64, n)  # type: ignore[no-untyped-call]


def compiled(signature: object, *, any_order: bool = False) -> Callable[[F], F]:
    """Compile for one signature, so that no call ever compiles; cached on disk where a folder can be written.

    Args:
        signature: types of result and arguments.
        any_order: sums may be taken in another order, which lets them be vectorised.
    """
    kind = cast("Any", signature)

    def decorate(function: F) -> F:
        fast = {"reassoc", "contract"} if any_order else False
        options: Any = {"nogil": True, "error_model": "numpy", "fastmath": fast}
        try:
            return cast("F", njit(kind, cache=True, **options)(function))
        except RuntimeError:  # both the package and the user's cache folder are read-only
            return cast("F", njit(kind, **options)(function))

    return decorate
