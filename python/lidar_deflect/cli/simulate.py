"""``lidar-deflect simulate``: a capture of a bending blade, with its truth."""

from pathlib import Path
from typing import Annotated

import typer

from lidar_deflect.cli.options import Json, Overwrite, Quiet, Threads, Verbose, free
from lidar_deflect.cli.talk import Talk

SCHEMA = "lidar-deflect.simulate/1"


def simulate(
    config: Annotated[
        Path | None,
        typer.Option("--config", "-c", metavar="TOML", help="Scene; default: that of `demo`."),
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="DIR", help="Folder to write.")
    ] = Path("simulated"),
    overwrite: Overwrite = False,
    threads: Threads = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Simulate a test with its truth.

    Writes a capture of a bending blade, its configuration, survey channels and truth.
    """
    talk = Talk(as_json=json, quiet=quiet, verbose=verbose)
    free(out, overwrite)
    from lidar_deflect import scene
    from lidar_deflect.simulation import simulate as run

    described = scene.Scene.load(config) if config else scene.demo()
    with talk.progress("simulating") as progress:
        folder = run(described, out, overwrite=overwrite, progress=progress.amount, threads=threads)
    files = sorted(path.name for path in folder.iterdir())
    document = {"schema": SCHEMA, "folder": str(folder), "files": files}
    talk.result(document, f"{folder}: " + " ".join(files))
    talk.note(f"next: lidar-deflect measure -c {folder / 'test.toml'} {folder / 'capture.pcap'}")
