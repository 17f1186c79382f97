"""Is the report sound in a real browser: what it says, draws, plays and asks for?"""

import json
from collections.abc import Iterator
from pathlib import Path

import polars as pl
import pytest

import beam_folders
import folders
from browser import Browser, browser, needs_browser
from lidar_deflect import comparison, report, tables
from lidar_deflect.pipeline import Test
from scenes import SCENES, configuration, needs_scenes

pytestmark = needs_browser


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with browser() as found:
        yield found


def opened(page: Browser, path: Path, *, dark: bool = False) -> None:
    page.errors.clear()
    page.requests.clear()
    page.open(path, dark=dark)
    page.run("window.drawAllFigures()")
    page.wait("[...document.querySelectorAll('.plot')].every((plot) => plot.querySelector('svg'))")


def check_sound(page: Browser, path: Path) -> None:
    """No complaint, no request but for the file itself, something in every figure."""
    assert page.errors == []
    assert {url for url in page.requests if not url.startswith("data:")} == {
        path.resolve().as_uri()
    }
    empty = page.run(
        "[...document.querySelectorAll('.plot')].filter((plot) => !plot._fullData.some("
        "(trace) => trace._length > 0 || (trace.x && trace.x.length))).map((plot) => plot.id)"
    )
    assert empty == []


def shown_numbers(page: Browser, table: str) -> list[list[float | str]]:
    """Cells of a table: the number behind each, else its text."""
    return page.run(  # type: ignore[no-any-return]
        f"[...document.querySelectorAll('[data-name=\"{table}\"] tbody tr')].map((row) =>"
        "[...row.children].map((cell) => cell.dataset.value === undefined ?"
        " cell.textContent.trim() : Number(cell.dataset.value)))"
    )


def check_key_table(page: Browser, folder: Path) -> None:
    """The numbers of the key table are those of steps.parquet."""
    steps = tables.read(folder / "steps.parquet", name="steps")
    head = page.run(
        "[...document.querySelectorAll('[data-name=\"key\"] thead th')].map((cell) =>"
        " cell.textContent.trim().replace(/\\s+/g, ' '))"
    )
    rows = shown_numbers(page, "key")
    assert len(rows) == steps.height
    for cells, row in zip(rows, steps.iter_rows(named=True), strict=True):
        found = dict(zip(head, cells, strict=True))
        assert (found["step"], found["section"]) == (row["step"], row["section"])
        for label, column in (("dx", "dx_m"), ("dy", "dy_m"), ("dz", "dz_m"), ("total", "d_m")):
            if row[column] is not None:
                assert found[f"{label} (mm)"] == pytest.approx(1e3 * row[column], abs=1e-9)


def check_replay(page: Browser) -> None:
    """Slider, play and views change what is drawn."""
    page.run("document.querySelector('.replay').scrollIntoView()")
    picture = "document.querySelector('.replay .ink').toDataURL()"
    before = page.run(picture)
    page.run(
        "(() => { const slider = document.querySelector('.replay .time');"
        "slider.value = slider.max; slider.dispatchEvent(new Event('input')); })()"
    )
    after = page.run(picture)
    assert after != before
    page.run("document.querySelector('[data-view=top]').click()")
    assert page.run(picture) != after
    page.run("document.querySelector('.replay .speed').value = '64'")
    page.run("document.querySelector('.replay .play').click()")  # from the end: starts again
    page.wait("Number(document.querySelector('.replay .time').value) > 3")
    page.wait(f"{picture} !== {json.dumps(before)}")


@pytest.fixture(
    scope="module",
    params=[
        ("edge", "paper"),
        ("flap", "paper"),
        pytest.param(("edge", "beam"), marks=pytest.mark.slow),
        pytest.param(("flap", "beam"), marks=pytest.mark.slow),
    ],
    ids=lambda each: " ".join(each),
)
def scene_folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    name, method = request.param
    folder = tmp_path_factory.mktemp(f"{name}-{method}")
    config = folder / "test.toml"
    config.write_text(
        configuration(name).replace("[prediction]", "[prediction]\ntolerance_percent = 7.0")
    )
    result = Test.load(config).measure(SCENES / name / "capture.pcap.gz", method=method)
    written = result.save(folder / "results")
    for file in ("theory.csv", "wire.csv", "truth.parquet"):
        comparison.save(written, comparison.compare(written, SCENES / name / file))
    return written


@needs_scenes
def test_the_report_of_a_scene_is_sound(chromium: Browser, scene_folder: Path) -> None:
    path = report.write(scene_folder)
    opened(chromium, path)
    check_key_table(chromium, scene_folder)
    check_replay(chromium)
    check_sound(chromium, path)


def test_the_report_of_the_demos_yard_is_sound(
    chromium: Browser, short_test: Path, tmp_path: Path
) -> None:
    result = Test.load(short_test / "test.toml").measure(short_test / "capture.pcap")
    folder = result.save(tmp_path / "results")
    comparison.save(folder, comparison.compare(folder, short_test / "truth.parquet"))
    path = report.write(folder)
    opened(chromium, path, dark=True)
    check_key_table(chromium, folder)
    check_replay(chromium)
    check_sound(chromium, path)


def test_zooming_one_section_zooms_all(chromium: Browser, tmp_path: Path) -> None:
    opened(chromium, report.write(beam_folders.write(tmp_path / "beam")))
    chromium.run("Plotly.relayout('figure-1', {'xaxis3.range': [10, 20]}).then(() => 1)")
    ranges = "[1, 2, 3].map((k) => document.getElementById(`figure-${k}`).layout.xaxis.range)"
    chromium.wait(f"JSON.stringify({ranges}) === '[[10,20],[10,20],[10,20]]'")
    assert chromium.errors == []


def one_step(folder: Path) -> Path:
    frame = beam_folders.deflection(duration_s=60.0).filter(pl.col("t_s") < 5.0)
    return folders.write(folder, frame, config=beam_folders.CONFIG, run=beam_folders.run_facts())


CASES = {
    "complete": lambda folder: beam_folders.write(folder),
    "a missing lidar": lambda folder: beam_folders.write(
        folder, run=beam_folders.run_facts() | {"absent_lidars": ["L2"]}
    ),
    "no reference to compare with": lambda folder: beam_folders.write(folder, compared=False),
    "no load channel": lambda folder: beam_folders.write(folder, load=False),
    "one section": lambda folder: beam_folders.write(folder, {"tip": 110.0}),
    "one step": one_step,
    "fatigue": lambda folder: fatigue(folder),
    "nothing but deflection": lambda folder: folders.write(folder, run={}),
}


def fatigue(folder: Path) -> Path:
    written = beam_folders.write(folder)
    tables.write(
        beam_folders.cycles(), written / "cycles.parquet", {tables.HASH_KEY: "0"}, name="cycles"
    )
    return written


@pytest.mark.parametrize("case", CASES)
def test_any_run_gives_a_sensible_page(chromium: Browser, tmp_path: Path, case: str) -> None:
    folder = CASES[case](tmp_path / "results")
    path = report.write(folder)
    opened(chromium, path)
    check_key_table(chromium, folder)
    check_sound(chromium, path)
    text = chromium.run("document.body.innerText")
    for word in ("NaN", "None", "undefined", "null", "{", "inf "):
        assert word not in text.replace("utc_s", ""), word


def test_an_hour_at_10_hz_opens_at_once_and_stays_small(chromium: Browser, tmp_path: Path) -> None:
    path = report.write(beam_folders.write(tmp_path / "hour", duration_s=3600.0))
    assert path.stat().st_size < 15e6
    chromium.open(path)
    seconds = chromium.run("performance.getEntriesByType('navigation')[0].domInteractive / 1000")
    assert seconds < 5.0
    opened(chromium, path)
    check_sound(chromium, path)


@pytest.mark.slow
def test_200_sections_are_shown(chromium: Browser, tmp_path: Path) -> None:
    sections = {f"S{k}": 50.0 + 0.3 * k for k in range(200)}
    path = report.write(beam_folders.write(tmp_path / "many", sections, rate_hz=2.0))
    assert path.stat().st_size < 15e6
    chromium.errors.clear()
    chromium.requests.clear()
    chromium.open(path)
    assert len(shown_numbers(chromium, "key")) == 200 * 5
    assert "194 more sections" in chromium.run("document.body.innerText")
    assert chromium.errors == []


BAD = "<script>alert(1)</script>\"'>&lt;" + "长" * 150 + "x" * 120


def test_a_hostile_name_is_text_everywhere(chromium: Browser, tmp_path: Path) -> None:
    config = beam_folders.CONFIG.replace('"edge-110"', json.dumps(BAD))
    path = report.write(
        beam_folders.write(tmp_path / "bad", {BAD: 84.0, "tip": 110.0}, config=config)
    )
    opened(chromium, path)
    check_sound(chromium, path)
    assert BAD in chromium.run("document.body.textContent")
    assert chromium.run("document.querySelector('h1').textContent") == BAD
    wide = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
    assert chromium.run(wide) == 0


def test_it_can_be_read_without_a_mouse(chromium: Browser, tmp_path: Path) -> None:
    opened(chromium, report.write(beam_folders.write(tmp_path / "results")))
    assert chromium.run(
        "[...document.querySelectorAll('table')].every((table) => table.caption &&"
        " table.querySelectorAll('thead th[scope=col]').length &&"
        " [...table.querySelectorAll('tbody tr')].every((row) => row.querySelector('th[scope]')))"
    )
    assert chromium.run("[...document.querySelectorAll('.scroll')].every((e) => e.tabIndex === 0)")
    assert chromium.run(
        "[...document.querySelectorAll('input, select')].every((e) => e.labels.length)"
    )
    before = chromium.run("document.querySelector('.replay').replay.turn")
    chromium.run(
        "document.querySelector('.stage').dispatchEvent(new KeyboardEvent('keydown',"
        " {key: 'ArrowLeft', bubbles: true}))"
    )
    assert chromium.run("document.querySelector('.replay').replay.turn") != before
