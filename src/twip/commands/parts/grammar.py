"""The command line's grammar: a mistake in it is one line."""

import argparse
import sys
from typing import NoReturn

from ...errors import clear

USAGE = 2
"""Exit status when the options cannot be understood."""


class Grammar(argparse.ArgumentParser):
    """A parser that tells what it does not understand in one line instead of under the whole usage."""

    def error(self, message: str) -> NoReturn:
        """Print the mistake and where the options are explained, and exit with status 2."""
        text = " ".join(message.split("\n"))
        print(clear(f"{self.prog}: error: {text} ({self.prog} --help explains the options)"), file=sys.stderr)
        sys.exit(USAGE)
