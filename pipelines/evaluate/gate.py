"""Gates: ``ate.rmse>0.10`` fails a run whose figure is so. The unit at the end of a key may be left out."""

import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from ...formats.errors import ConfigError

_OPERATORS: dict[str, Callable[[float, float], bool]] = {
    ">=": operator.ge,
    "<=": operator.le,
    "==": operator.eq,
    "!=": operator.ne,
    ">": operator.gt,
    "<": operator.lt,
}
_NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_UNITS = ("m", "rad", "s", "m2", "rad2")
"""Tried in this order: ``ate.rmse`` is ``ate.rmse_m``."""


@dataclass(frozen=True, slots=True)
class Gate:
    """One condition under which a run fails.

    Attributes:
        text: as it was given.
        path: of the figure, with dots.
        operation: one of > >= < <= == !=.
        bound: what it is compared with.
    """

    text: str
    path: str
    operation: str
    bound: float


def parse_gate(text: str) -> Gate:
    """Read ``path operator number``.

    Raises:
        ConfigError: it is not of this form.
    """
    match = re.fullmatch(rf"\s*([A-Za-z_][\w.]*)\s*(>=|<=|==|!=|>|<)\s*({_NUMBER})\s*", text)
    if match is None:
        raise ConfigError(f"--fail-if: {text!r} is no condition. Write one like 'ate.rmse>0.10'.")
    return Gate(text, match[1], match[2], float(match[3]))


def failed_gates(gates: Sequence[Gate], result: Mapping[str, object]) -> list[str]:
    """Return one phrase for each gate that a result does not pass.

    A figure that does not exist (``null``) fails its gate: nothing shows that it is good.

    Raises:
        ConfigError: there is no such figure; the message lists those there are.
    """
    figures = dict(_figures(result, ""))
    failed = []
    for gate in gates:
        path = next((p for p in (gate.path, *(f"{gate.path}_{u}" for u in _UNITS)) if p in figures), None)
        if path is None:
            known = ", ".join(figures)
            raise ConfigError(f"--fail-if: there is no figure {gate.path!r}. There are: {known}.")
        value = figures[path]
        if value is None:
            failed.append(f"{path} does not exist ({gate.text.strip()})")
        elif _OPERATORS[gate.operation](value, gate.bound):
            failed.append(f"{path} is {value:.6g} ({gate.text.strip()})")
    return failed


def _figures(node: Mapping[str, object], prefix: str) -> Iterator[tuple[str, float | None]]:
    for key, value in node.items():
        if isinstance(value, Mapping):
            yield from _figures(value, f"{prefix}{key}.")
        elif value is None or isinstance(value, int | float):
            yield f"{prefix}{key}", None if value is None else float(value)
