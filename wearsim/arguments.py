"""Invalid arguments of functions, which are options of verbs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class ArgumentError(ValueError):
    """An invalid argument of a function.

    Parameters
    ----------
    argument : str
        Name of the argument.
    text : str
        What is wrong with it.
    """

    def __init__(self, argument: str, text: str) -> None:
        self.argument = argument
        super().__init__(text)


@contextmanager
def checking_argument(argument: str) -> Iterator[None]:
    """Turn a ValueError into the error of an argument.

    Raises
    ------
    ArgumentError
        With the message of the ValueError.
    """
    try:
        yield
    except ArgumentError:
        raise
    except ValueError as error:
        raise ArgumentError(argument, str(error)) from error
