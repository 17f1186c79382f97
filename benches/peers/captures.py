"""Simulated captures that all jobs share, made once, in target/bench."""

from __future__ import annotations

import gzip
import shutil
import subprocess
from pathlib import Path

from lidar_deflect import scene as scenes
from lidar_deflect.simulation import simulate

PROJECT = Path(__file__).parents[2]
FOLDER = PROJECT / "target" / "bench"
REFERENCES = PROJECT.parent / "shared" / "captures"
"""Captures of real sensors, where there are some."""


def yard() -> Path:
    """Folder of the demo's test: four VLP-16."""
    return _made("yard", scenes.demo())


def single() -> Path:
    """Capture of the first of its lidars alone, two minutes of it."""
    scene = scenes.demo()
    loading = scene.loading.model_copy(update={"hold_s": 25.0})
    alone = scene.model_copy(update={"lidars": scene.lidars[:1], "loading": loading})
    return _made("alone", alone) / "capture.pcap"


def _made(name: str, scene: scenes.Scene) -> Path:
    folder = FOLDER / name
    if not folder.exists():
        FOLDER.mkdir(parents=True, exist_ok=True)
        simulate(scene, folder)
    return folder


def repeated(path: Path, size: int) -> Path:
    """A capture whose records are repeated until it has so many bytes."""
    longer = FOLDER / f"{path.parent.name}-{size}.pcap"
    if not longer.exists():
        data = path.read_bytes()
        with longer.open("wb") as file:
            file.write(data)
            while file.tell() < size:
                file.write(data[24:])
    return longer


def gzipped(path: Path) -> Path:
    """The same file in gzip."""
    packed = path.with_name(path.name + ".gz")
    if not packed.exists():
        with path.open("rb") as plain, gzip.open(packed, "wb", compresslevel=6) as file:
            shutil.copyfileobj(plain, file)
    return packed


def zstandard(path: Path) -> Path:
    """The same file in Zstandard."""
    import zstandard as zstd

    packed = path.with_name(path.name + ".zst")
    if not packed.exists():
        with path.open("rb") as plain, packed.open("wb") as file:
            zstd.ZstdCompressor(level=3).copy_stream(plain, file)
    return packed


def in_rust(job: str, path: Path) -> tuple[float, int, int]:
    """Run a job of the Rust example `throughput`: seconds, datagrams (or bytes), points."""
    program = PROJECT / "target" / "release" / "examples" / "throughput"
    told = subprocess.run([program, job, path], capture_output=True, text=True, check=True).stdout
    seconds, count, points = told.split()
    return float(seconds), int(count), int(points)
