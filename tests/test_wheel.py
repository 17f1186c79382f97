"""Does one wheel install and measure where there is no Rust and nothing of this project?"""

import json
import os
import re
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
BIN = "Scripts" if os.name == "nt" else "bin"
MATURIN = shutil.which("maturin", path=str(Path(sys.executable).parent)) or ""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not MATURIN, reason="maturin is not in this environment"),
    pytest.mark.skipif(shutil.which("cargo") is None, reason="cargo is not on the path"),
]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel into a folder of its own, with the compiled code that is there already."""
    out = tmp_path_factory.mktemp("dist")
    subprocess.run([sys.executable, "tools/third_party.py"], cwd=ROOT, check=True)
    command = [MATURIN, "build", "--release", "--locked", "--out", str(out)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (path,) = out.glob("*.whl")
    return path


def test_the_wheel_is_for_every_python_from_3_11(wheel: Path) -> None:
    assert "-cp311-abi3-" in wheel.name


def test_the_wheel_carries_types_and_licences(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    for wanted in ("py.typed", "_native.pyi", "LICENSE-MIT", "LICENSE-APACHE"):
        assert any(name.endswith(f"/{wanted}") for name in names), wanted
    assert any(name.endswith("LICENSE-THIRD-PARTY") for name in names)
    assert not any("tests/" in name or name.endswith(".rs") for name in names)


def _pins(folder: Path) -> Path:
    """Return the pinned versions as constraints: the wheel itself must name what it needs."""
    text = (ROOT / "requirements" / "run.txt").read_text(encoding="utf-8")
    pins = re.findall(r"^([\w.\-]+==[^\\\n]+)", text, flags=re.MULTILINE)
    path = folder / "constraints.txt"
    path.write_text("\n".join(pins) + "\n", encoding="utf-8")
    return path


def test_the_wheel_runs_the_demo_in_an_empty_environment(wheel: Path, tmp_path: Path) -> None:
    home = tmp_path / "environment"
    venv.create(home, with_pip=True)
    pip = [home / BIN / "python", "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    subprocess.run([*pip, "-c", _pins(tmp_path), wheel], cwd=tmp_path, check=True)
    bare = {"PATH": str(home / BIN), "HOME": str(tmp_path)}
    if os.name == "nt":
        bare["SYSTEMROOT"] = os.environ["SYSTEMROOT"]
    command = [str(home / BIN / "lidar-deflect"), "demo", "--json"]
    done = subprocess.run(
        command, cwd=tmp_path, env=bare, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert {row["section"] for row in document["rows"]} >= {"S84", "S100", "S110"}
    assert (tmp_path / document["report"]).is_file()
