"""Is the PDF an archive of itself: PDF/A, fonts inside, every number on paper?"""

import io
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import beam_folders
import folders
from lidar_deflect import tables
from lidar_deflect.errors import MissingExtraError
from lidar_deflect.plots import Plots
from lidar_deflect.report import digits, drawn, fonts, pdf

pytest.importorskip("typst", reason="the extra pdf is not installed")
pytest.importorskip("matplotlib", reason="the extra pdf is not installed")

needs_poppler = pytest.mark.skipif(
    shutil.which("pdftotext") is None, reason="no poppler here to read the PDF back"
)
HAS_CHINESE = not fonts.choose(["尖端"]).missing


def text_of(path: Path) -> str:
    done = subprocess.run(
        ["pdftotext", "-layout", path, "-"], capture_output=True, text=True, check=True
    )
    return done.stdout


@pytest.fixture(scope="module")
def complete(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = beam_folders.write(tmp_path_factory.mktemp("pdf") / "results")
    return folder, pdf.write(folder, folder.parent / "report.pdf")


def test_it_says_that_it_is_pdf_a_2(complete: tuple[Path, Path]) -> None:
    content = complete[1].read_bytes()
    assert content.startswith(b"%PDF-1.7")
    assert b"<pdfaid:part>2</pdfaid:part>" in content
    assert b"<pdfaid:conformance>A</pdfaid:conformance>" in content
    assert b"/Marked true" in content  # tagged: it can be read out


@needs_poppler
def test_every_font_is_embedded(complete: tuple[Path, Path]) -> None:
    done = subprocess.run(["pdffonts", complete[1]], capture_output=True, text=True, check=True)
    rows = done.stdout.splitlines()[2:]
    assert rows
    assert all(row[72:76].strip() == "yes" or " yes yes" in row for row in rows)
    if HAS_CHINESE:
        assert not re.search("LastResort", done.stdout)
        assert len({row.split()[0] for row in rows}) >= 3


@needs_poppler
def test_the_numbers_of_the_key_table_stand_on_paper(complete: tuple[Path, Path]) -> None:
    folder, path = complete
    text = text_of(path)
    for row in tables.read(folder / "steps.parquet").iter_rows(named=True):
        shown = digits.millimetres(row["d_m"], row["ud_m"]).text
        assert shown.replace(digits.THIN, " ") in text.replace(digits.THIN, " ")
    assert "Within ±7" in text
    assert "Signatures" in text
    pages = int(re.findall(r"page \d+ of (\d+)", text)[0])
    assert [int(k) for k in re.findall(r"page (\d+) of", text)] == list(range(1, pages + 1))
    # every figure but the replay, which moves
    captions = sorted(int(k) for k in re.findall(r"Figure (\d+)\. ", text))
    assert captions == [k for k in range(1, captions[-1] + 1) if k != 4]


@needs_poppler
@pytest.mark.skipif(not HAS_CHINESE, reason="no font with Chinese here (fonts-noto-cjk)")
def test_a_chinese_name_is_written_in_chinese(complete: tuple[Path, Path]) -> None:
    assert "尖端 tip" in text_of(complete[1])


def test_what_no_font_has_is_said_and_replaced(tmp_path: Path) -> None:
    odd = "\U000f0000"  # for private use: no font has it
    folder = folders.write(
        tmp_path / "results", folders.deflection({f"S{odd}": (84.0, 3.0, 0.1, 0.0)})
    )
    said: list[str] = []
    pdf.write(folder, tmp_path / "report.pdf", warn=said.append)
    assert len(said) == 1
    assert odd in said[0]
    assert "fonts-noto-cjk" in said[0]


@needs_poppler
def test_hostile_names_are_text(tmp_path: Path) -> None:
    bad = '#panic("x") $a$ *b* <script> @c ' + "x" * 250
    folder = beam_folders.write(tmp_path / "results", {bad: 84.0, "tip": 110.0})
    text = text_of(pdf.write(folder, tmp_path / "report.pdf"))
    assert '#panic("x") $a$ *b* <script> @c' in re.sub(r"\s+", " ", text)


@pytest.mark.parametrize(
    "write",
    [
        lambda folder: folders.write(folder, run={}),
        lambda folder: folders.write(folder, folders.deflection(folders.TIP).head(1)),
        lambda folder: beam_folders.write(folder, load=False, compared=False),
    ],
    ids=["paper", "one state", "no load"],
)
def test_poor_results_have_a_pdf_too(tmp_path: Path, write) -> None:  # type: ignore[no-untyped-def]
    path = pdf.write(write(tmp_path / "results"), tmp_path / "report.pdf")
    assert path.stat().st_size > 20_000


def test_a_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "typst", None)
    with pytest.raises(MissingExtraError) as caught:
        pdf.write(folders.write(tmp_path / "results"), tmp_path / "report.pdf")
    assert caught.value.hint == "pip install 'lidar-deflect[pdf]'"


@needs_poppler
def test_every_page_has_ink_within_its_margins(complete: tuple[Path, Path], tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    subprocess.run(
        ["pdftoppm", "-r", "40", "-gray", "-png", complete[1], tmp_path / "page"], check=True
    )
    for path in sorted(tmp_path.glob("page*.png")):
        ink = np.asarray(image.open(io.BytesIO(path.read_bytes()))) < 200
        assert ink.mean() > 0.002
        # nothing runs off the sheet: 5 mm at the sides are white
        assert not ink[:, :8].any()
        assert not ink[:, -8:].any()


def test_figures_on_paper_show_what_figures_on_screen_show(tmp_path: Path) -> None:
    from lidar_deflect.folder import Folder

    plots = Plots(Folder(beam_folders.write(tmp_path / "results")))
    image = drawn.svg(plots.time_series("S84"), ["DejaVu Sans"]).decode()
    assert image == drawn.svg(plots.time_series("S84"), ["DejaVu Sans"]).decode()
    for word in ("dx (m)", "dz (m)", "time (s)", "100 %", "95 %"):
        assert word in image
