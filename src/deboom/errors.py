"""The one exception that a user is meant to read."""


class InputError(ValueError):
    """Something the user brought is missing or wrong.

    The message is one sentence that names the file, the item and the remedy. The command line
    prints it alone, without a traceback, and exits with code 2.
    """
