"""The command ``logpose``: a lazy table of subcommands, and errors turned into exit statuses.

Nothing but click is imported until a subcommand is called, so ``logpose --help`` answers at once.
"""

import importlib
import json
import os
import signal
import sys
import threading
import traceback
from types import FrameType

import click

from .. import __version__
from ..formats.errors import ExitStatus, GateError, LogposeError

COMMANDS = {
    "detect-circles": "Find round lamps and stickers in images of a ceiling.",
    "localize-pf": "Track a robot under identical ceiling landmarks with a particle filter.",
    "stripe-pose": "Find stripe marks in images, and from one of them where the robot is.",
    "run": "Run any pipeline file over logs.",
    "simulate": "Make a log with ground truth from a world file.",
    "evaluate": "Compare a trajectory with its reference.",
    "inspect": "Show what a log holds and which subcommands suit it.",
    "convert": "Import public data sets; convert trajectories and landmark maps.",
}


class Terminated(KeyboardInterrupt):
    """The process was asked to end (SIGTERM): like an interrupt, so that whoever writes a file removes what is half."""


class LazyGroup(click.Group):
    """A group that knows its commands by name and one line of help, and imports a command when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        """Return the names in the order a user meets them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Import the module that is named after the command."""
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f".{cmd_name.replace('-', '_')}", __package__)
        command = module.command
        assert isinstance(command, click.Command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Say which command was probably meant."""
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            import difflib

            close = difflib.get_close_matches(args[0], COMMANDS, n=1, cutoff=0.5)
            hint = f"Did you mean {close[0]!r}?" if close else f"There is: {', '.join(COMMANDS)}."
            raise click.UsageError(f"no subcommand {args[0]!r}. {hint}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """Write the table without importing any command."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=(
        "Exit status: 0 done, 1 failed, 2 usage, 3 written but data was lost, 4 a gate failed, 130 interrupted, "
        "141 the reader of the output went away, 143 terminated."
    ),
)
@click.version_option(__version__, prog_name="logpose")
def group() -> None:
    """From logs to poses: localise and map from ROS bags and MCAP files, offline, with an error report."""


def main() -> None:
    """Run the command line and leave with its exit status."""
    os.environ.setdefault("OPENCV_LOG_LEVEL", "ERROR")  # its warnings of damaged images would stand beside our line
    is_main = threading.current_thread() is threading.main_thread()
    if is_main and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _terminate)
    sys.exit(call(sys.argv[1:]))


def call(arguments: list[str]) -> int:
    """Run the command line and return its exit status; every error is one line on stderr."""
    try:
        # Not group.main(): it ends with status 1 when the reader of our output goes away.
        with group.make_context("logpose", list(arguments), obj=list(arguments)) as context:
            status = group.invoke(context)
        sys.stdout.flush()
        return int(status or 0)
    except click.exceptions.Exit as err:
        return err.exit_code
    except click.exceptions.NoArgsIsHelpError as err:
        click.echo(err.ctx.get_help() if err.ctx else "", err=True)
        return ExitStatus.USAGE
    except click.ClickException as err:
        at = getattr(err, "ctx", None)
        where = at.command_path if at is not None else "logpose"
        message = _misspelt(err) if isinstance(err, click.NoSuchOption) else err.format_message()
        message = message[:1].lower() + message[1:] + ("" if message.endswith((".", "?", ")")) else ".")
        return _fail(f"{where}: {message} See {where} --help.", ExitStatus.USAGE, arguments)
    except GateError as err:
        return _fail(str(err), err.exit_status, [word for word in arguments if word != "--json"])  # figures are out
    except LogposeError as err:
        return _fail(str(err), err.exit_status, arguments)
    except Terminated:
        return _fail("terminated.", ExitStatus.TERMINATED, [])
    except (KeyboardInterrupt, click.exceptions.Abort):
        return _fail("interrupted.", ExitStatus.INTERRUPTED, [])
    except BrokenPipeError:
        # The reader of our output has gone; the interpreter must not complain about it once more at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ExitStatus.BROKEN_PIPE
    except Exception as err:  # noqa: BLE001  the last door: no traceback reaches a user who did not ask for it
        text = f"logpose: {type(err).__name__}: {err}. This is a fault of logpose; --traceback shows where."
        return _fail(text.replace("\n", " "), ExitStatus.FAILED, arguments)


def _misspelt(err: click.NoSuchOption) -> str:
    """Say which option was probably meant; click's own words differ from version to version."""
    close = " or ".join(repr(name) for name in sorted(err.possibilities or ()))
    return f"no such option {err.option_name!r}." + (f" Did you mean {close}?" if close else "")


def _terminate(_number: int, _frame: FrameType | None) -> None:
    raise Terminated


def _fail(message: str, status: int, arguments: list[str]) -> int:
    if "--traceback" in arguments:
        traceback.print_exc()
    click.echo(message, err=True)
    if "--json" in arguments:
        click.echo(json.dumps({"error": {"message": message, "exit_status": int(status)}}))
    return int(status)
