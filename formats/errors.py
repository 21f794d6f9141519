"""The one error tree, and the exit status that each error ends with.

::

    LogposeError            exit 1   failed, nothing usable written
    ├── FormatError         exit 1   a file is not what it should be: which file, what is wrong, what to do
    ├── StageError          exit 1   a stage could not go on: which stage, at which event, why
    ├── ConfigError         exit 2   a wrong word on the command line or in a pipeline file
    └── GateError           exit 4   everything ran, but a gate (``--fail-if``) was not passed

Every message is one line, ``where: what is wrong. what to do.`` Exit 3 (written, but data was lost) is no error: it
follows from the counts of the run.
"""

from enum import IntEnum


class ExitStatus(IntEnum):
    """What the shell sees."""

    DONE = 0
    FAILED = 1
    USAGE = 2
    LOSS = 3
    GATE = 4
    INTERRUPTED = 130
    BROKEN_PIPE = 141
    TERMINATED = 143


class LogposeError(Exception):
    """Something logpose can explain in one line."""

    exit_status = ExitStatus.FAILED


class FormatError(LogposeError):
    """A file is missing, damaged, or not what it should be."""


class StageError(LogposeError):
    """A stage could not go on.

    Attributes:
        is_located: the message already names file, line, stage and event.
    """

    is_located = False


class ConfigError(LogposeError):
    """A wrong word on the command line or in a pipeline file."""

    exit_status = ExitStatus.USAGE


class GateError(LogposeError):
    """A gate was not passed; the results are written."""

    exit_status = ExitStatus.GATE
