"""The command line: `twip COMMAND`."""

import argparse
import os
import sys
from collections.abc import Sequence
from importlib.metadata import version
from io import TextIOWrapper
from pathlib import Path

from .commands.parts.grammar import Grammar
from .errors import TwipError
from .extras import command
from .interrupts import INTERRUPTED, deferred_interrupt

CLOSED_PIPE = 141
"""Exit status when nobody reads on: 128 + SIGPIPE."""
USUAL_ORDER = (
    "demo",
    "build",
    "run",
    "check",
    "report",
    "plot",
    "animate",
    "view",
    "container",
    "replay",
    "parameters",
    "identify",
    "paper",
    "sweep",
    "stability",
)
"""In which the help lists commands; others follow by name."""
DESCRIPTION = """\
examples:
  twip demo
  twip build
  twip run ssp/twip.ssp
  twip COMMAND --help

A balancing robot as FMI co-simulation components, the master that runs them and the logs that show them."""


def _commands() -> dict[str, str]:
    """Return what each command does, as the first line of its module says; reading that line imports nothing."""
    found = {}
    for path in sorted(Path(__file__).with_name("commands").glob("[!_]*.py")):
        with path.open(encoding="utf-8") as file:
            title = file.readline().strip().strip('"')
        found[path.stem] = title.removeprefix(f"`twip {path.stem}`: ").removesuffix(".")
    order = [name for name in USUAL_ORDER if name in found]
    return {name: found[name] for name in dict.fromkeys([*order, *found])}


COMMANDS = _commands()
"""Each is a module of `commands`; only the one that is called is imported, for some take their time."""


def parser(chosen: str | None = None) -> Grammar:
    """Return the command line's grammar, that of a command in full if it is the `chosen` one."""
    top = Grammar(
        "twip",
        usage="twip COMMAND [options]",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("--version", action="version", version=f"twip {version('twip')}")
    commands = top.add_subparsers(title="commands", required=True, metavar="COMMAND", prog="twip")
    for name, summary in COMMANDS.items():
        description = commands.add_parser(name, help=summary, formatter_class=argparse.RawDescriptionHelpFormatter)
        if name == chosen:
            command(name, f"{__package__}.commands.{name}").declare(description)
    return top


def main(words: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status; a user's mistake is one line on standard error and status 1."""
    words = list(sys.argv[1:] if words is None else words)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal that lacks a character gets a question mark
    try:
        with deferred_interrupt():
            grammar = parser(words[0] if words else None)
        arguments, unknown = grammar.parse_known_args(words)
        if unknown:
            command = Grammar(f"twip {words[0]}") if words[0] in COMMANDS else grammar
            command.error(f"unrecognized arguments: {' '.join(unknown)}")
        arguments.words = words
        status = int(arguments.run(arguments))
        sys.stdout.flush()
    except TwipError as error:
        for problem in error.problems:
            print(f"twip: {problem}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("twip: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # whoever read our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return CLOSED_PIPE
    except OSError as error:
        if _output_works():
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what is left would fail again when Python ends
        print(f"twip: standard output cannot be written: {error.strerror}", file=sys.stderr)
        return 1
    return status


def _output_works() -> bool:
    """Tell whether standard output takes what it was given: a disk may be full, an FMU may have closed it."""
    try:
        sys.stdout.flush()
        os.fstat(1)
    except OSError:
        return False
    return True


if __name__ == "__main__":
    sys.exit(main())
