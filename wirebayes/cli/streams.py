"""Standard streams that end no command: closed ones, readers that leave, encodings that lack a letter."""

import io
import os
import sys
from typing import TYPE_CHECKING, TextIO

from wirebayes.errors import InputError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


def open_standard_streams() -> None:
    """Make the process's streams fit to be printed to, whatever they are.

    A closed one is read as empty and swallows what is printed; its number must not go to a file of results. Letters
    that the encoding of a stream lacks are printed as their codes.
    """
    if sys.stdin is None:
        sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: SIM115 - for the whole process
    sys.stdout = _fit_for_print(sys.stdout, "standard output")
    sys.stderr = _fit_for_print(sys.stderr, "standard error")


def _fit_for_print(stream: TextIO | None, name: str) -> TextIO:
    if stream is None:
        return open(os.devnull, "w", encoding="utf-8")
    if not isinstance(stream, io.TextIOWrapper):
        return stream
    if stream.isatty():
        stream.reconfigure(errors="backslashreplace")
        return stream
    stream.flush()
    kept = io.BufferedWriter(_MayLeave(stream.fileno(), name))
    return io.TextIOWrapper(kept, stream.encoding, "backslashreplace", line_buffering=stream.line_buffering)


class _MayLeave(io.FileIO):
    """A pipe or file; once its reader has left, as ``head`` does, or its disk is full, the rest is thrown away."""

    def __init__(self, number: int, name: str) -> None:
        super().__init__(number, "wb", closefd=False)
        self._called = name

    def write(self, data: "ReadableBuffer", /) -> int:
        """As that of files; a full disk is an `InputError`."""
        try:
            return super().write(data)
        except OSError as error:
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            if isinstance(error, BrokenPipeError):
                return memoryview(data).nbytes
            found = f"{self._called}: cannot be written ({os.strerror(error.errno or 0)})"
            raise InputError(f"{found}, expected room for what is printed") from error
