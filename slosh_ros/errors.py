"""The one exception a user's bad input may raise; the shells turn it into one clear message."""


class InputError(ValueError):
    """
    Something the user gave cannot be used.

    The message names the input, says what is wrong with it and what to do, in the user's units.
    """
