"""What `twip run --live` adds: the run in Foxglove, and inputs from there and from the keyboard."""

import os
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from signal import SIGINT

from ...cosim import LiveInputs, System, open_inputs
from ...errors import TwipError
from ...lab.foxglove_protocol import WEB_APP
from ...lab.live import HOST, PORT, LiveView
from ...lab.teleop import HELP, Teleop
from .keyboard import keys
from .terminal import notice


def declare(parser: ArgumentParser) -> None:
    """Declare the option."""
    parser.add_argument(
        "--live",
        nargs="?",
        const=f"{HOST}:{PORT}",
        metavar="HOST:PORT",
        help=f"show the run in Foxglove as it goes (needs the extra `view`) and take inputs from there and, at a "
        f"terminal, from the keyboard ({HELP}); paces the run to the wall clock; default address: {HOST}:{PORT}",
    )
    parser.add_argument(
        "--live-origin",
        action="append",
        default=[],
        metavar="ORIGIN",
        help="with --live, let web pages of ORIGIN (such as https://viewer.example:8080) see and steer the run too; "
        f"default: {WEB_APP} and programs that are no web pages",
    )


def live_inputs(arguments: Namespace, system: System) -> LiveInputs | None:
    """Return the inputs to set while the run goes on, none without `--live`; raises TwipError."""
    if arguments.live is None and arguments.live_origin:
        raise TwipError(f"--live-origin {arguments.live_origin[0]} needs --live")
    return None if arguments.live is None else LiveInputs(system, open_inputs(system))


def live_view(
    arguments: Namespace,
    system: System,
    metadata: Mapping[str, Mapping[str, str]],
    inputs: LiveInputs,
    start_time: float,
) -> LiveView:
    """Listen at `HOST:PORT` and say so; raises TwipError."""
    address, origins = arguments.live, arguments.live_origin
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal() or int(port) > 65535:
        raise TwipError(f"--live {address}: must be HOST:PORT, such as {HOST}:{PORT}")
    view = LiveView(system.channels, metadata, inputs, host, int(port), start_time, origins, _warn)
    notice(f"live at {view.address} (Foxglove: Open connection)")
    return view


def _warn(text: str) -> None:
    print(f"twip: warning: {text}", file=sys.stderr, flush=True)


@contextmanager
def steering(inputs: LiveInputs | None) -> Iterator[None]:
    """Take keys while the block runs, if there are inputs to set and a terminal."""
    if inputs is None:
        yield
        return
    teleop = Teleop(inputs, lambda words: print(words, file=sys.stderr))

    def press(key: str) -> None:
        if not teleop.press(key):
            os.kill(os.getpid(), SIGINT)  # ends the run between two steps

    with keys(press) as heard:
        if heard:
            notice(HELP)
        try:
            yield
        finally:
            teleop.close()
