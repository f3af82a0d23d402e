"""Errors that a user can mend."""


class InputError(ValueError):
    """Bad input: one line that names the value, the place and the remedy."""
