"""Kind -> what converts it: the one table of ``logpose convert``.

A new data set is a file in ``datasets/`` and a line here; so is a product that gets a second format. Everything is
named as ``module:function`` below ``formats``, so that nothing is imported before it is asked for.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .datasets.imported import Imported


@dataclass(frozen=True, slots=True)
class Option:
    """A whole number that only one kind takes.

    Attributes:
        default: where it is not given.
        help: one line.
    """

    default: int
    help: str


@dataclass(frozen=True, slots=True)
class Conversion:
    """What converts one kind.

    Attributes:
        function: ``module:function``, called as ``function(source, target, **options)``; it writes the target and
            returns what it wrote beside it, or None where the target is all.
        options: by name, which is the keyword of the function and the flag of the command.
    """

    function: str
    options: Mapping[str, Option] = field(default_factory=dict)

    def __call__(self, source: str, target: str, **options: int) -> "Imported | None":
        """Import the function and call it."""
        module, _, name = self.function.partition(":")
        convert: Any = getattr(import_module(f".{module}", __package__), name)
        imported: Imported | None = convert(source, target, **options)
        return imported


CONVERSIONS = {
    "trajectory": Conversion("trajectories.trajectory:convert_trajectory"),
    "landmarks": Conversion("maps.landmarks:convert_landmarks"),
    "mrclam": Conversion("datasets.mrclam:convert_mrclam", {"robot": Option(1, "which of the five robots.")}),
    "dlr-circles": Conversion("datasets.dlr_circles:convert_dlr_circles"),
}
