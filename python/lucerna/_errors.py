"""What goes wrong, and what is only said."""

from ._lucerna import InputError

__all__ = ["InputError", "LucernaWarning"]


class LucernaWarning(UserWarning):
    """What the command prints as a warning: the text names the place and what was done instead."""
