"""One HTML file that works offline, from a result folder and nothing else.

`document` says what a report is made of, `build` makes it from a
folder, chapter by chapter; `page` sets it as HTML, `spreadsheet` as xlsx, `pdf` on paper.
Its sentences are those of `lidar_deflect.words`.
"""

from pathlib import Path

from lidar_deflect.files import write_text
from lidar_deflect.folder import Folder
from lidar_deflect.report.build import document
from lidar_deflect.report.page import render

__all__ = ["document", "render", "write"]


def write(folder: str | Path, out: str | Path | None = None, *, overwrite: bool = True) -> Path:
    """Write the report of a result folder.

    Parameters
    ----------
    folder
        Result folder.
    out
        File to write; default: ``report.html`` in the folder.
    overwrite
        Whether a file of that name may be replaced.

    Returns
    -------
    pathlib.Path
        The file.

    Raises
    ------
    ResultNotFoundError
        If `folder` is no result folder.
    ResultError
        If one of its files cannot be read.
    OutputError
        If the report cannot be written; nothing is left behind.
    """
    found = Folder(folder)
    path = Path(out) if out is not None else found.path / "report.html"
    return write_text(path, render(document(found)), overwrite=overwrite)
