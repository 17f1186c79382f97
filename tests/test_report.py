import json
import re
from html.parser import HTMLParser
from pathlib import Path

import polars as pl
import pytest
from plotly.offline import get_plotlyjs

import folders
from lidar_deflect import comparison, report, tables
from lidar_deflect.errors import OutputError, ResultError, ResultNotFoundError
from lidar_deflect.report import digits

BAD = "<script>alert('x')</script>"


class Page(HTMLParser):
    """Tags, addresses, text outside of scripts, and figures of a report."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.scripts = 0
        self.addresses: list[str] = []
        self.text = ""
        self.figures: list[dict] = []
        self._inside = ""
        self._is_data = False
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        facts = dict(attrs)
        self.addresses += [
            v or "" for k, v in attrs if k in ("src", "href", "srcset", "action", "data")
        ]
        if tag in ("script", "style"):
            self._inside = tag
            self.scripts += tag == "script"
            self._is_data = facts.get("type") == "application/json"

    def handle_endtag(self, tag: str) -> None:
        if tag == self._inside:
            self._inside = ""

    def handle_data(self, data: str) -> None:
        if not self._inside:
            self.text += data + "\n"
        elif self._is_data:
            self.figures.append(json.loads(data))


def page(folder: Path) -> tuple[Page, str]:
    html = report.write(folder).read_text(encoding="utf-8")
    return Page(html), html


def full_folder(path: Path) -> Path:
    """A result folder with everything that a report can show."""
    folder = folders.write(path, health=folders.health(), rejected=rejected())
    theory = path.parent / "theory.csv"
    theory.write_text("section_m,deflection_mm_at_100_percent\n84,3273\n100,4921\n110,6002\n")
    comparison.save(folder, comparison.compare(folder, theory))
    return folder


def rejected() -> pl.DataFrame:
    columns: dict[str, tables.Values] = dict.fromkeys(tables.SCHEMAS["rejected"].names)
    columns |= {"time": [folders.EPOCH_NS] * 2, "t_s": [0.0] * 2}
    return tables.build("rejected", columns | {"reason": ["cable"] * 2, "count": [3, 4]})


def test_the_report_shows_the_numbers_of_the_tables(tmp_path: Path) -> None:
    found, _ = page(full_folder(tmp_path / "results"))
    text = found.text
    assert "edge-110" in text
    # 6.07, -0.71, -0.21 m; its norm; the prediction, and (6115.1 - 6002) / 6002
    for number in (
        "6.070",
        "-0.710",
        "-0.210",
        "6.115",
        f"6{digits.THIN}002",
        f"1.88{digits.THIN}%",
    ):
        assert number in text
    assert "interpolated" in text
    assert "overhead: the blade stood straight above a lidar" in text
    assert "yaw comes from the mounting" in text
    assert "ab" * 32 in text
    assert "not_udp" in text
    assert re.search(r"cable\n+\s*7\n", text)
    # time series of three sections, errors, load, shapes, plan, health
    assert len(found.figures) == 3 + 1 + 3 + 1


def test_every_figure_has_data_and_a_caption(tmp_path: Path) -> None:
    found, html = page(full_folder(tmp_path / "results"))
    assert all(figure["data"] for figure in found.figures)
    assert re.findall(r"<b>Figure (\d+)\.</b>", html) == [
        str(k + 1) for k in range(len(found.figures))
    ]


def test_the_report_asks_no_host_for_anything(tmp_path: Path) -> None:
    found, html = page(full_folder(tmp_path / "results"))
    assert found.addresses == ["data:,"]
    own = html.replace(get_plotlyjs(), "")
    assert html.count(get_plotlyjs()) == 1  # the library stands in it once, with its banner
    assert "Licensed under the MIT license" in html
    assert not re.findall(r"(?:https?:)?//[a-z0-9-]+\.[a-z]", own)
    assert "url(" not in own
    assert "@import" not in own
    assert "default-src 'none'" in own  # and the browser is told to refuse


def test_no_button_sends_data_to_a_host(tmp_path: Path) -> None:
    found, _ = page(full_folder(tmp_path / "results"))
    for figure in found.figures:
        assert "sendChartToCloud" in figure["layout"]["modebar"]["remove"]


def test_hostile_names_show_as_text(tmp_path: Path) -> None:
    good, _ = page(full_folder(tmp_path / "good"))
    frame = folders.deflection({BAD: (84.0, 3.28, -0.5, -0.1)})
    config = folders.CONFIG.replace(
        '"edge-110"', json.dumps(BAD + '"><img src=x onerror=alert(1)>')
    )
    run = folders.run_facts() | {
        "warnings": [BAD],
        "inputs": [{"file": BAD, "bytes": 1, "sha256": BAD}],
        "drops": {BAD: 3},
        "evidence": {BAD: {BAD: [BAD]}},
        "method": BAD,
        "gates": {"failed": [BAD]},
    }
    folder = folders.write(
        tmp_path / "bad", frame, config=config, run=run, health=folders.health([BAD])
    )
    found, html = page(folder)
    assert BAD in found.text
    assert BAD not in html
    assert "<img" not in html.replace(get_plotlyjs(), "")
    # one script per figure, the library and ours: as in a page of good names, less its figures
    assert found.scripts - len(found.figures) == good.scripts - len(good.figures) == 2


@pytest.mark.parametrize(
    "frame",
    [
        folders.deflection(folders.TIP, load=False),
        folders.deflection(folders.TIP, overhead_s=(0.0, 19.9)),
        folders.deflection(folders.TIP).head(35),
        folders.deflection(folders.TIP).head(1),
        folders.deflection(u_m=0.004, overhead_s=None),
    ],
    ids=["no load", "nothing measured", "one step", "one state", "uncertain"],
)
def test_poor_results_have_a_report_too(tmp_path: Path, frame: pl.DataFrame) -> None:
    found, _ = page(folders.write(tmp_path / "results", frame, run={}))
    assert "Nothing was compared" in found.text
    assert "NaN" not in found.text
    assert "None" not in found.text


def test_tables_alone_make_a_report(tmp_path: Path) -> None:
    folder = folders.write(tmp_path / "results")
    for name in ("test.toml", "run.json", "steps.parquet"):
        (folder / name).unlink()
    found, _ = page(folder)
    assert "No load step was found" in found.text
    assert "results" in found.text  # named after its folder


def test_uncertainty_is_shown_where_it_is_stated_and_its_lack_where_not(tmp_path: Path) -> None:
    stated, _ = page(folders.write(tmp_path / "a", folders.deflection(u_m=0.004)))
    assert "±0.0080" in stated.text
    assert "expanded uncertainty of the total (k = 2)" in stated.text
    silent, _ = page(folders.write(tmp_path / "b"))
    assert "This method states no uncertainty." in silent.text


def test_the_same_folder_gives_the_same_bytes(tmp_path: Path) -> None:
    folder = full_folder(tmp_path / "results")
    first = report.write(folder, tmp_path / "a.html").read_bytes()
    assert report.write(folder, tmp_path / "b.html").read_bytes() == first
    assert not list(tmp_path.glob(".*"))


def test_what_is_no_result_folder_or_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ResultNotFoundError, match="no result folder"):
        report.write(tmp_path)
    folder = folders.write(tmp_path / "results")
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        report.write(folder, tmp_path / "file" / "report.html")
    with pytest.raises(OutputError, match="exists already"):
        report.write(folder, tmp_path / "file", overwrite=False)
    (folder / "run.json").write_text("{")
    with pytest.raises(ResultError, match="cannot be read"):
        report.write(folder)


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (digits.metres(-0.00001), "0.000"),
        (digits.metres(None), digits.NONE),
        (digits.expanded(0.0013), "±0.0026"),
        (digits.expanded(0.02), "±0.040"),
        (digits.expanded(None), ""),
        (digits.millimetres(31.6239), f"31{digits.THIN}624"),
        (digits.percent(-7.3475), f"-7.35{digits.THIN}%"),
        (digits.count(1_234_567), f"1{digits.THIN}234{digits.THIN}567"),
        (digits.size(38_196_075), f"38.2{digits.THIN}MB"),
        (digits.size(12), f"12{digits.THIN}B"),
    ],
)
def test_numbers_have_sensible_digits(shown: str, expected: str) -> None:
    assert shown == expected
