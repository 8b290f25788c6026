"""Errors of arguments, found before the extension is called."""

from __future__ import annotations

import errno
import operator
import os
import pathlib
from typing import IO, Any

from ._edo_smc import ScenarioError


def invalid(key: str, cause: str, remedy: str) -> ScenarioError:
    """Returns the error of an argument, with its parts as attributes."""
    error = ScenarioError(f"{key}: {cause}; {remedy}")
    error.key, error.cause, error.remedy = key, cause, remedy
    return error


#: Largest seed, a number of 64 bits.
MOST = (1 << 64) - 1


def whole(name: str, value: Any, least: int, most: int = (1 << 32) - 1) -> int:
    """Returns a whole number, or raises an error that names the argument."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} = {value!r}: expected a whole number") from None
    if not least <= number <= most:
        raise invalid(name, f"found {number}", f"expected a whole number from {least} to {most}")
    return number


def opened(path: pathlib.Path, force: bool, newline: str | None = None) -> IO[str]:
    """Opens a file for writing. An existing one is an error that names the way out."""
    try:
        return path.open("w" if force else "x", encoding="utf-8", newline=newline)
    except FileExistsError:
        message = f"{os.strerror(errno.EEXIST)}; give force=True to overwrite it"
        raise FileExistsError(errno.EEXIST, message, str(path)) from None
