"""One HTML file that works offline, from a result folder and nothing else.

`words` holds every sentence, `content` and `made_of` gather the facts, `figures` draws;
template.html, style.css and figures.js beside them are put into the file, so that it asks no host
for anything.
"""

from importlib.resources import files
from pathlib import Path

import jinja2
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from lidar_deflect.files import write_text
from lidar_deflect.folder import Folder
from lidar_deflect.report import content, made_of, words
from lidar_deflect.report.figures import Figures

__all__ = ["render", "write"]


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
    return write_text(path, render(found), overwrite=overwrite)


def render(folder: Folder) -> str:
    """Return the report as HTML text."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.from_string(_beside("template.html"))
    figures = Figures(folder)
    return template.render(
        words=words,
        title=content.title(folder),
        headline=content.headline(folder),
        warnings=content.warnings(folder),
        key_table=content.key_table(folder) if folder.steps.height else None,
        compared=content.comparison_tables(folder),
        statuses=made_of.statuses(folder),
        lidars=made_of.lidars(folder),
        drops=made_of.drops(folder),
        inputs=made_of.inputs(folder),
        streams=made_of.streams(folder),
        facts=made_of.facts(folder),
        evidence=made_of.evidence(folder),
        method=made_of.method(folder),
        configuration=made_of.configuration(folder),
        comparison_figure=figures.comparison(),
        curves=figures.curves(),
        shapes=figures.shapes(),
        health_figure=figures.health(),
        style=Markup(_beside("style.css")),  # our own file
        script=Markup(_beside("figures.js")),  # our own file
        plotly=Markup(get_plotlyjs()),  # the library's own file
    )


def _beside(name: str) -> str:
    return files(__name__).joinpath(name).read_text(encoding="utf-8")
