"""Public data sets as logs: each importer reads the files as they are published and writes what a robot would log.

What a method must not see (ids, barcodes, the truth) stands on topics under ``/ground_truth``. Every importer is called
as ``importer(source, out_path, **options)`` and returns an ``Imported``.
"""

from collections.abc import Callable

from .dlr_circles import convert_dlr_circles
from .imported import Imported
from .mrclam import convert_mrclam

IMPORTERS: dict[str, Callable[..., Imported]] = {
    "mrclam": convert_mrclam,
    "dlr-circles": convert_dlr_circles,
}

__all__ = ["IMPORTERS", "Imported", "convert_dlr_circles", "convert_mrclam"]
