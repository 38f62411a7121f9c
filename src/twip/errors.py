"""The one exception that reaches a user."""

LONGEST_LINE = 2000
"""Characters of a message's line; more than that comes from damaged input."""


def clear(line: str) -> str:
    """Return a line fit for a terminal: what is not printable is escaped, the middle of an endless one left out."""
    if len(line) > LONGEST_LINE:
        line = f"{line[: LONGEST_LINE // 4]} … {line[-LONGEST_LINE // 4 :]}"
    if line.isprintable():
        return line
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in line)


class TwipError(Exception):
    """A mistake in the user's input, or a failure of a component, told in one line per problem.

    Every line names what is wrong, where (component, file and line, or time in s) and the rule that was broken. The
    command line prints the message without a traceback and exits with status 1.
    """

    def __init__(self, message: str = ""):
        super().__init__("\n".join(map(clear, message.split("\n"))))
