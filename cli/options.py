"""Options that subcommands share; every default is None, so that a flag that is not given overrides no file."""

import math
from collections.abc import Callable
from typing import Any, TypeVar

import click
import yaml

from ..formats.errors import ConfigError

F = TypeVar("F", bound=Callable[..., Any])


class Number(click.ParamType):  # type: ignore[type-arg]
    """A finite number; click's own float takes nan and inf, and nan lies in any of its ranges."""

    name = "float"

    def __init__(self, above: float | None = None) -> None:
        """Accept only what is greater than ``above``, if it is given."""
        self.above = above

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number."""
        try:
            number = float(value)
        except ValueError:
            self.fail(f"{value!r} is not a number.", param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value!r} is not finite.", param, ctx)
        if self.above is not None and number <= self.above:
            self.fail(f"{value!r} is not greater than {self.above:g}.", param, ctx)
        return number


def traceback_option(function: F) -> F:
    """Add ``--traceback``."""
    return click.option("--traceback", is_flag=True, expose_value=False, help="Show where in the code an error arose.")(
        function
    )


def run_options(function: F) -> F:
    """Add what every command has that runs a pipeline over logs."""
    for decorate in reversed(_RUN_OPTIONS):
        function = decorate(function)
    return traceback_option(function)


_RUN_OPTIONS: list[Callable[[Any], Any]] = [
    click.argument("logs", nargs=-1, metavar="LOG..."),
    click.option(
        "-o",
        "--output",
        metavar="DIR",
        help="Run folder; - writes the main result to standard output. [default: LOG.COMMAND]",
    ),
    click.option(
        "-c",
        "--config",
        multiple=True,
        metavar="FILE",
        help="Pipeline file laid over the bundled one; may be partial, repeatable.",
    ),
    click.option("--set", "settings", multiple=True, metavar="STAGE.KEY=VALUE", help="One parameter; repeatable."),
    click.option(
        "--topic",
        "topics",
        multiple=True,
        metavar="ROLE=/NAME",
        help="Topic of a role (image, odometry, truth, ...); auto guesses, none leaves it out.",
    ),
    click.option("--stamp", type=click.Choice(["header", "log"]), help="Time that orders the log. [default: header]"),
    click.option("--start", metavar="T", help="Begin here: seconds from the first message, or a stamp."),
    click.option("--end", metavar="T", help="End before this time."),
    click.option("--duration", metavar="S", help="Length of the part to read [s]."),
    click.option("--seed", type=int, metavar="N", help="Seed of every random stage."),
    click.option("--workers", type=int, metavar="N", help="Threads for stages that work on single messages."),
    click.option("--depfile", metavar="FILE", help="Also write the dependencies of the result for make."),
    click.option("--show-pipeline", is_flag=True, help="Print the pipeline that would run, and stop."),
    click.option("--json", "as_json", is_flag=True, help="Print the report to standard output."),
    click.option("-q", "--quiet", is_flag=True, help="Say nothing but warnings and errors."),
]


def setting(text: str) -> tuple[str, object]:
    """Split ``KEY=VALUE`` of a ``--set``; the value is YAML."""
    key, equals, value = text.partition("=")
    if not equals:
        raise ConfigError(f"--set {text}: no value. Write KEY=VALUE.")
    try:
        return key.strip(), yaml.safe_load(value)
    except yaml.YAMLError as err:
        raise ConfigError(f"--set {text}: the value is not YAML. Quote it.") from err
