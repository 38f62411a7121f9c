"""The command line: `twip COMMAND`."""

import argparse
import os
import sys
from collections.abc import Sequence
from importlib.metadata import version
from io import TextIOWrapper

from .commands.parts.grammar import Grammar
from .errors import TwipError
from .extras import command
from .interrupts import INTERRUPTED, deferred_interrupt

CLOSED_PIPE = 141
"""Exit status when nobody reads on: 128 + SIGPIPE."""
COMMANDS = {
    "demo": "build the robot and stand it up from 27 degrees",
    "build": "build the FMUs and SSPs",
    "run": "run a system of FMUs",
    "check": "say what a system, an FMU or a parameter set is, and what is wrong with it",
    "report": "make an HTML file of a log: the moving robot, plots, metrics",
    "plot": "draw signals of a log, for papers",
    "animate": "draw the robot of a log as an animated picture",
    "view": "look at a log in Rerun: the robot in 3D beside plots",
    "container": "pack a system of FMUs into one FMU",
    "replay": "make an FMU that plays a log",
    "parameters": "list a system's parameters",
    "identify": "friction and inertia of a motor from bench data",
    "paper": "run the paper's experiments and check its claims",
    "sweep": "many runs with other values, here or on a cluster",
    "stability": "where the controller stands although its model is wrong",
}
"""Each is a module of `commands`; only the one that is called is imported, for some take their time."""
DESCRIPTION = """\
examples:
  twip demo
  twip build
  twip run ssp/twip.ssp
  twip COMMAND --help

A balancing robot as FMI co-simulation components, the master that runs them and the logs that show them."""


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
    return status


if __name__ == "__main__":
    sys.exit(main())
