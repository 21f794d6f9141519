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
    click.option("--json", "as_json", is_flag=True, default=None, help="Print the report to standard output."),
    click.option("-q", "--quiet", is_flag=True, help="Say nothing but warnings and errors."),
]


method_option = click.option(
    "--method", type=click.Choice(["best", "paper"]), help="Our way, or the paper's. [default: best]"
)
camera_option = click.option("--camera", metavar="FILE", help="Calibration, instead of CameraInfo in the log.")
initial_pose_option = click.option(
    "--initial-pose", metavar="X,Y,DEG", help="Start pose [m, m, deg], or a topic, instead of /initialpose."
)
reference_option = click.option(
    "--reference", metavar="FILE|LOG:/TOPIC", help="Trajectory to measure the error against."
)
waypoints_option = click.option("--waypoints", metavar="FILE", help="Waypoints whose passes are tabulated.")
overlays_option = click.option(
    "--overlays", metavar="DIR", help="Also draw what was found over each image; a folder in the run folder."
)


def flag_of(option: str) -> str:
    """Return how the command line writes an option."""
    words = {"settings": "set", "topics": "topic", "as_json": "json"}
    return "--" + words.get(option, option).replace("_", "-")


def numbers(text: str, flag: str, count: int, form: str) -> list[float]:
    """Return the finite numbers of ``text``, separated by commas; ``form`` says which they are."""
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise ConfigError(f"{flag} {text}: is not {form}. Give {count} finite numbers.")
    return values


def setting(text: str) -> tuple[str, object]:
    """Split ``KEY=VALUE`` of a ``--set``; the value is YAML."""
    key, equals, value = text.partition("=")
    if not equals:
        raise ConfigError(f"--set {text}: no value. Write KEY=VALUE.")
    try:
        return key.strip(), yaml.safe_load(value)
    except yaml.YAMLError as err:
        raise ConfigError(f"--set {text}: the value is not YAML. Quote it.") from err
