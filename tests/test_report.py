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
        f"6{digits.THIN}070",
        f"{digits.MINUS}710",
        f"{digits.MINUS}210",
        f"6{digits.THIN}115",
        f"6{digits.THIN}002",
        "1.88",
    ):
        assert number in text
    assert "interpolated" in text
    assert "overhead: the blade stood straight above a lidar" in text
    assert "yaw comes from the mounting" in text
    assert "ab" * 32 in text
    assert "not_udp" in text
    assert re.search(r"cable\n+\s*7\n", text)
    # time series of three sections, replay, load, creep, shapes, errors, plan, health
    assert len(found.figures) == 3 + 1 + 2 + 1 + 1 + 1 + 1


def test_every_figure_has_data_and_a_caption(tmp_path: Path) -> None:
    found, html = page(full_folder(tmp_path / "results"))
    replays = [figure for figure in found.figures if "marks" in figure]
    assert len(replays) == 1
    assert all(figure["data"] for figure in found.figures if "marks" not in figure)
    assert re.findall(r"<b>Figure (\d+)\.</b>", html) == [
        str(k + 1) for k in range(len(found.figures))
    ]


def test_the_report_asks_no_host_for_anything(tmp_path: Path) -> None:
    found, html = page(full_folder(tmp_path / "results"))
    assert [each for each in found.addresses if not each.startswith("#")] == ["data:,"]
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
        if "marks" in figure:
            continue
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
    # one script per figure, the library and two of ours: as in a page of good names
    assert found.scripts - len(found.figures) == good.scripts - len(good.figures) == 3


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
    assert f"±{digits.THIN}8.0" in stated.text
    assert "expanded uncertainty (k\u00a0=\u00a02, about 95\u00a0%)" in stated.text
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
        (digits.millimetres(31.6239).text, f"31{digits.THIN}624"),
        (digits.percent(-7.3475), f"{digits.MINUS}7.35{digits.THIN}%"),
        (digits.count(1_234_567), f"1{digits.THIN}234{digits.THIN}567"),
        (digits.size(38_196_075), f"38.2{digits.THIN}MB"),
        (digits.size(12), f"12{digits.THIN}B"),
        (digits.duration(59.94), "59.9 s"),
        (digits.duration(3600.0), "1 h 0 min"),
    ],
)
def test_numbers_are_set_for_people(shown: str, expected: str) -> None:
    assert shown == expected


@pytest.mark.parametrize(
    ("u_m", "value", "interval"),
    [
        # U = 2 u keeps two digits, and so does the value: 8.6 mm; 86 mm; 0.86 mm
        (0.0043, f"4{digits.THIN}966.8", "8.6"),
        (0.043, f"4{digits.THIN}967", "86"),
        (0.00043, f"4{digits.THIN}966.81", "0.86"),
        (0.43, f"4{digits.THIN}967", "860"),
    ],
)
def test_a_value_has_the_digits_of_its_uncertainty(u_m: float, value: str, interval: str) -> None:
    cell = digits.millimetres(4.96681, u_m)
    assert (cell.text, cell.interval) == (value, f"±{digits.THIN}{interval}")
    assert cell.value == pytest.approx(4966.81)
    assert cell.u == pytest.approx(2e3 * u_m)


def test_the_budget_of_the_largest_step_has_a_row_per_source(tmp_path: Path) -> None:
    zero = dict.fromkeys(("x_m", "y_m", "z_m", "dx_m", "dy_m", "dz_m", "d_m"), 0.0)
    terms = {"range_noise": zero | {"d_m": 0.0011}, "registration": zero | {"d_m": 0.0042}}
    entries = [
        {"step": step, "section": "S100", "s_m": 100.0, "terms": terms} for step in ("0 %", "100 %")
    ]
    found, _ = page(folders.write(tmp_path / "results", run={"method": "beam", "budget": entries}))
    assert "registration of the lidars" in found.text
    assert "8.4" in found.text  # twice 4.2 mm
    assert "total deflection at 100" in found.text.replace("\u00a0", " ")
