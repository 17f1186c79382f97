"""Results reach the disk whole or not at all: written under a temporary name, then renamed."""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
import threading
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from lidar_deflect.errors import LidarDeflectError, OutputError

if TYPE_CHECKING:
    from collections.abc import Iterator


def write_text(path: Path, text: str, *, overwrite: bool = False) -> Path:
    """Write a text file whole, UTF-8.

    Raises
    ------
    OutputError
        If it exists and may not be overwritten, or cannot be written.
    """
    with whole_file(path, overwrite=overwrite) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


@contextmanager
def whole_file(path: Path, *, overwrite: bool = False) -> Iterator[Path]:
    """Give a temporary path beside `path` that takes its name when the block ends well."""
    _refuse_existing(path, overwrite)
    with _output_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        os.close(handle)
        temporary = Path(name)
        try:
            yield temporary
            temporary.chmod(0o666 & ~_umask())
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)


@contextmanager
def whole_folder(path: Path, *, overwrite: bool = False) -> Iterator[Path]:
    """Give a temporary folder beside `path` that takes its name when the block ends well.

    A folder that is overwritten stays as it was until the new one is complete.
    """
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        _refuse_existing(path, overwrite)
    with _output_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
        try:
            yield temporary
            temporary.chmod(0o777 & ~_umask())
            _swap(temporary, path)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)


def keep_interrupts_from_polars() -> None:
    """Let Ctrl-C reach Python alone, which hears it as soon as a call into polars has returned.

    From its import on polars listens before Python does, and answers an interrupt while it writes
    by panics that it prints itself. Python's handler, set once more, takes that place again.
    """
    import polars  # noqa: F401 - so that it does not come later

    handler = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is threading.main_thread() and handler is not None:
        signal.signal(signal.SIGINT, handler)


def _swap(new: Path, path: Path) -> None:
    if not path.exists():
        new.rename(path)
        return
    old = Path(tempfile.mkdtemp(prefix=f".{path.name}.old.", dir=path.parent))
    path.rename(old / path.name)
    try:
        new.rename(path)
    except OSError:
        (old / path.name).rename(path)
        raise
    finally:
        shutil.rmtree(old, ignore_errors=True)


def _refuse_existing(path: Path, overwrite: bool) -> None:
    if path.exists() and not overwrite:
        raise OutputError(
            f"{path} exists already",
            code="output.exists",
            hint="choose another name, or allow it with --overwrite (overwrite=True)",
        )


@contextmanager
def _output_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except LidarDeflectError:
        raise
    except OSError as error:
        raise OutputError(
            f"{path} cannot be written: {error.strerror or error}",
            code="output.unwritable",
            hint="check the folder, its permissions and the free space",
        ) from error


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
