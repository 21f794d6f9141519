"""What a run says to a person, on stderr: progress on a terminal, each kind of notice once, what came out."""

import sys
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import click

from ..formats.errors import ExitStatus
from ..formats.events import Event, Notice
from ..formats.files import replacing_text

if TYPE_CHECKING:
    from ..pipelines.engine.report import Result


class Talk:
    """Watches the events of a run."""

    def __init__(self, *, quiet: bool) -> None:
        """Say less if ``quiet``."""
        self.quiet = quiet
        self._notices: dict[str, Notice] = {}
        self._bar: Any = None
        self._task: Any = None
        self._count = 0

    def __enter__(self) -> Self:
        """Show a bar if a person watches."""
        if sys.stderr.isatty() and not self.quiet:
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            self._bar = Progress(
                TextColumn("messages"),
                BarColumn(),
                MofNCompleteColumn(),
                TimeRemainingColumn(),
                console=Console(stderr=True),
                transient=True,
            )
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, err: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.stop()

    def watch(self, event: Event, log: Any) -> None:
        """Take note of one event that left the pipeline."""
        if isinstance(event, Notice):
            self._notices.setdefault(event.code, event)
        if self._bar is None or not event.topic:
            return
        self._count += 1
        if self._task is None:
            total = sum(count.announced or 0 for count in log.counts.values())
            self._task = self._bar.add_task("read", total=total or None)
        if self._count % 50 == 0:
            self._bar.update(self._task, completed=self._count)

    def conclude(self, result: "Result") -> None:
        """Say once what should be known, what was lost, and where the results lie.

        Notices wait for the end, so that an error stands alone on its line.
        """
        for code, notice in self._notices.items():
            n = result.notices[code][1]
            message = notice.message if notice.message.endswith(".") else f"{notice.message}."
            click.echo(f"{notice.source}: {message}" + (f" ({n} times)" if n > 1 and notice.is_loss else ""), err=True)
        for problem in result.log.problems:
            click.echo(problem, err=True)
        for topic, count in sorted(result.log.counts.items()):
            if count.dropped:
                reasons = ", ".join(f"{n} x {why}" for why, n in sorted(count.why.items()))
                total = f" of {count.announced}" if count.announced is not None else ""
                click.echo(f"{topic}: {count.dropped}{total} messages lost: {reasons}.", err=True)
        if self.quiet:
            return
        for line in _verdict(result):
            click.echo(line, err=True)
        if result.out is not None:
            page = result.out / "report.html"
            click.echo(f"results in {result.out}/" + (f", report {page}" if page.is_file() else ""), err=True)
        if result.status is ExitStatus.LOSS:
            click.echo("data was lost or skipped: exit status 3.", err=True)


def _verdict(result: "Result") -> list[str]:
    evaluation: Any = result.results.get("evaluation")
    if not evaluation:
        return []
    ate = evaluation["ate"]
    return [
        (
            f"error against the truth: rmse {ate['rmse_m']:.3f} m, max {ate['max_m']:.3f} m "
            f"({evaluation['matched']} of {evaluation['estimate_total']} poses compared)"
        )
    ]


def depfile(path: str, result: "Result") -> None:
    """Write what the run folder was made from, as a make rule."""
    from ..pipelines.engine.report import input_files

    target = (result.out or Path()) / "report.json"
    inputs = " ".join(_escape(str(file.path)) for file in input_files(result))
    with replacing_text(path) as file:
        file.write(f"{_escape(str(target))}: {inputs}\n")


def _escape(name: str) -> str:
    return name.replace("$", "$$").replace(" ", "\\ ").replace("#", "\\#")
