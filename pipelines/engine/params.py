"""Parameters of a stage: a frozen, strict pydantic model, every field described with its unit."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

__all__ = ["Field", "InputPath", "OutputPath", "Params", "PathRole"]


class Params(BaseModel):
    """Base of every stage's parameters: unknown keys are refused, nothing is converted in silence."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True, slots=True)
class PathRole:
    """Marks a string parameter as a file, so that the engine can resolve it."""

    kind: Literal["input", "output"]


InputPath = Annotated[str, PathRole("input")]
"""A file a stage reads; relative to the pipeline file that names it."""

OutputPath = Annotated[str, PathRole("output")]
"""A file a stage writes; relative to the run folder; ``-`` is standard output."""
