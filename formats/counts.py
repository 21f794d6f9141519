"""What became of every message of a topic."""

from collections import defaultdict
from dataclasses import dataclass, field

LATE = "stamp goes back by more than 1 s"
NO_STAMP = "no header stamp, log time used"
MISSING = "announced but not in the file"


@dataclass
class TopicCount:
    """What became of a topic's messages; announced = read + outside + dropped once the log has been read.

    Attributes:
        announced: by the files' own indexes, None when they do not say.
        read: messages that became events.
        outside: messages outside the time window.
        dropped: messages that were lost, undecodable, or too late.
        why: reason -> number; also remarks that are no loss.
    """

    announced: int | None = None
    read: int = 0
    outside: int = 0
    dropped: int = 0
    why: dict[str, int] = field(default_factory=lambda: defaultdict(int))

    def drop(self, reason: str, count: int = 1) -> None:
        """Count messages as lost."""
        self.dropped += count
        self.why[reason] += count

    def reconcile(self, *, is_complete: bool) -> None:
        """Compare what was read with what was announced; the rest is lost, or was not asked for."""
        rest = (self.announced or 0) - self.read - self.outside - self.dropped
        if rest > 0 and is_complete:
            self.drop(MISSING, rest)
        elif rest > 0:
            self.outside += rest
        self.why = dict(self.why)
