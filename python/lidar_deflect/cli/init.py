"""``lidar-deflect init``: a commented configuration from what captures hold."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from lidar_deflect.cli.options import Captures, Json, Overwrite, Quiet, Sensors, Verbose, free
from lidar_deflect.cli.options import sensor_models as models_of
from lidar_deflect.cli.talk import Talk

SCHEMA = "lidar-deflect.init/1"
HEAD = """\
# Configuration of a blade test, begun from what the captures hold.
# Lines that start with '# ' and a key are optional, or unknown to the captures: fill in and
# uncomment what you know. `lidar-deflect schema config` lists every key with its meaning.
# World frame: right-handed, metres, origin at the centre of the root flange, z to the tip along
# the unloaded axis, y up, x = y cross z (the horizontal load direction).
"""
LIDAR_COMMENTS = """\
# position_m = [0.0, 0.0, 0.0]       # surveyed optical centre, world frame
# position_u_m = 0.005               # its standard uncertainty
# axes = { x = "-x", y = "-y", z = "+z" }   # where the sensor's own axes point
"""
TAIL = """\
# Surveyed points on surfaces make the registration: six or more on the ground, spread out, and
# some on a wall or another vertical plane, which fixes the yaw.
# [[control]]
# on = "ground"                      # ground | wall | plane:NAME
# xyz_m = [-15.0, -8.2, 78.0]

# Sections whose deflection is wanted, by arc length from the root; the tip is the blade's length.
# [[sections]]
# name = "S84"
# s_m = 84.0

# The unloaded hold, in seconds since the first lidar packet; default: found from the data.
# [reference]
# from_s = 0.0
# to_s = 4.0

# [load]
# file = "load.csv"                  # steps and holds come from it
# time = "time_utc_s"
# value = "load_percent"
# direction = "+x"
"""


def init(
    captures: Captures,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="TOML", help="Configuration to write.")
    ] = Path("test.toml"),
    length: Annotated[
        float, typer.Option("--length", metavar="M", help="Length of the blade in metres.")
    ] = 100.0,
    sensor: Sensors = None,
    overwrite: Overwrite = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write a commented configuration for captures."""
    talk = Talk(as_json=json, quiet=quiet, verbose=verbose)
    free(out, overwrite)
    from lidar_deflect import capture
    from lidar_deflect.files import write_text

    with talk.progress("reading") as progress:
        opened = capture.open(captures, sensors=models_of(sensor))
        streams = opened.info(progress=progress.amount)["streams"]
    write_text(out, configuration(streams, length), overwrite=overwrite)
    document = {"schema": SCHEMA, "out": str(out), "lidars": len(streams)}
    talk.result(document, f"{out}: {len(streams)} lidars")
    talk.note(f"next: fill in what the survey knows, then lidar-deflect check -c {out} CAPTURE...")


def configuration(streams: Sequence[Mapping[str, Any]], length_m: float) -> str:
    """Write the text of a configuration for these streams."""
    return "\n".join([HEAD, *_blade(length_m), *_lidars(streams), TAIL])


def _blade(length_m: float) -> Iterator[str]:
    yield "[test]"
    yield 'id = "test"'
    yield 'kind = "static"                      # static | fatigue\n'
    yield "[blade]"
    yield f"length_m = {length_m!r}                   # arc length from root to tip: put in yours"
    yield '# geometry = "blade.csv"             # nominal geometry per station'
    yield '# leading_edge = "-x"                # where the leading edge points at zero twist'
    yield '# suction_side = "+y"                # where the suction side faces at zero twist\n'


def _lidars(streams: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    addresses = [stream["source"] for stream in streams]
    for index, stream in enumerate(streams):
        alone = addresses.count(stream["source"]) == 1
        yield "[[lidars]]"
        yield f'id = "L{index + 1}"'
        yield f'model = "{stream["model"]}"' + _candidates(stream)
        yield f'source = "{stream["source"] if alone else _with_port(stream)}"'
        yield LIDAR_COMMENTS


def _candidates(stream: Mapping[str, Any]) -> str:
    others = stream.get("candidates") or ()
    return f"   # could also be {', '.join(others)}" if others else ""


def _with_port(stream: Mapping[str, Any]) -> str:
    source, port = stream["source"], stream["port"]
    if port is None:
        return str(source)
    return f"[{source}]:{port}" if ":" in source else f"{source}:{port}"
