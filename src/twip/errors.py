"""The one exception that reaches a user."""


class TwipError(Exception):
    """A mistake in the user's input, or a failure of a component, told in one line per problem.

    Every line names what is wrong, where (component, file and line, or time in s) and the rule that was broken. The
    command line prints the message without a traceback and exits with status 1.
    """
