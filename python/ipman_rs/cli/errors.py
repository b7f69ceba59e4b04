"""How a command ends that could not do its work: one line on stderr, exit code 1."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..files.errors import FileError


@contextmanager
def one_line_errors(output: Path, advice: str = "", memory: str = "") -> Iterator[None]:
    """Ends the command where something could not be read or written, or something is missing.

    advice: after what is wrong with a disk or with memory, such as what is kept. memory: after the latter alone.
    """
    from concurrent.futures.process import BrokenProcessPool

    from . import console

    end = f"; {advice}" if advice else ""
    fewer = f"; {memory}" if memory else end
    try:
        yield
    except (FileError, ValueError, ImportError) as error:
        console.error(str(error))
    except MemoryError:
        console.error(f"there is not enough memory{fewer}")
    except BrokenProcessPool:
        console.error("a process ended too early, for want of memory perhaps; the same command, with fewer -j, goes on")
    except OSError as error:
        console.error(f"{error.filename or output}: {error.strerror or error}{end}")
    else:
        return
    sys.exit(1)


@contextmanager
def writing(output: Path, what: str = "") -> Iterator[None]:
    """Ends the command where the folder cannot be written, of which the report, say, is `what`."""
    from . import console

    try:
        yield
    except OSError as error:
        message = f"{what} cannot be written" if what else "cannot be written"
        console.error(f"{output}: {message} ({error.strerror or error}); choose another folder")
        sys.exit(1)


@contextmanager
def extra(name: str) -> Iterator[None]:
    """ImportError that names the extra with what cannot be imported."""
    try:
        yield
    except ImportError as error:
        raise ImportError(f"{error.name} is needed: pip install 'ipman_rs[{name}]'") from error
