"""Does what the README, the documents and the notebook show really run?"""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from lidar_deflect.cli.app import COMMANDS, run

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
NOTEBOOK = ROOT / "examples" / "capture_to_deflection.ipynb"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
LONGEST_EXAMPLE = 10


def python_blocks() -> list[str]:
    return re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)


@pytest.mark.slow
def test_the_ten_lines_to_a_first_result_run(tmp_path: Path) -> None:
    (code,) = python_blocks()
    assert len([line for line in code.splitlines() if line.strip()]) <= LONGEST_EXAMPLE
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "100 %" in done.stdout
    assert "S110" in done.stdout
    assert (tmp_path / "first-results" / "deflection.parquet").is_file()


@pytest.mark.slow
def test_the_notebook_runs_from_capture_to_deflection() -> None:
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    curve = notebook.cells[-1].outputs[0]["data"]["text/plain"]
    assert "dx_m" in curve


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_and_option_in_the_pages_exists(
    page: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    known = {name for name, _ in COMMANDS}
    for command in re.findall(
        r"^\s*lidar-deflect ([^#\n]*)", page.read_text("utf-8"), re.MULTILINE
    ):
        verb, *words = command.split()
        assert verb in known, command
        run([verb, "--help"])
        text = capsys.readouterr().out
        for option in (word for word in words if word.startswith("-")):
            assert re.search(rf"(^|[\s,]){re.escape(option)}\b", text, re.MULTILINE), command


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_within_the_project_leads_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        if not target.startswith("http"):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_every_exit_code_is_in_the_readme() -> None:
    for code in ("0 done", "2 usage", "3 input", "4 configuration", "7 environment", "130"):
        assert code in README
