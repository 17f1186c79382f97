"""Does make build what is missing, once, and say what it needs?"""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SHELL_TOOLS = ("sh", "find", "touch", "cat", "mkdir", "chmod", "env", "grep", "sed", "expand")
# Stands for every program that make would call: writes down how it was called; makes the
# environment when asked for one.
STAND_IN = """\
#!{shell}
echo "$0 $*" >> "{log}"
if [ "$1 $2" = "-m venv" ]; then
  mkdir -p "$3/bin"
  for name in python maturin; do cat "$0" > "$3/bin/$name"; chmod +x "$3/bin/$name"; done
fi
"""

pytestmark = pytest.mark.skipif(
    shutil.which("make") is None or os.name == "nt", reason="needs make and a POSIX shell"
)


class Yard:
    """A copy of what make looks at, with stand-ins for python and cargo."""

    def __init__(self, folder: Path, *, cargo: bool) -> None:
        self.folder = folder / "project"
        self.log = folder / "calls"
        self._copy()
        tools = folder / "tools"
        tools.mkdir()
        for name in SHELL_TOOLS:
            (tools / name).symlink_to(shutil.which(name) or name)
        for name in ("python3", "cargo")[: 2 if cargo else 1]:
            path = tools / name
            path.write_text(STAND_IN.format(shell=shutil.which("sh"), log=self.log))
            path.chmod(0o755)
        self.path = str(tools)

    def _copy(self) -> None:
        self.folder.mkdir()
        for name in ("Makefile", "pyproject.toml", "Cargo.toml", "Cargo.lock"):
            shutil.copy(ROOT / name, self.folder)
        for name in ("requirements", "rust"):
            shutil.copytree(
                ROOT / name, self.folder / name, ignore=shutil.ignore_patterns("target")
            )

    def make(self, *targets: str) -> subprocess.CompletedProcess[str]:
        command = [shutil.which("make") or "make", *targets]
        environment = {"PATH": self.path, "HOME": str(self.folder)}
        return subprocess.run(
            command, cwd=self.folder, env=environment, capture_output=True, text=True, check=False
        )

    def calls(self) -> list[str]:
        return self.log.read_text().splitlines() if self.log.exists() else []


def test_the_second_make_builds_nothing(tmp_path: Path) -> None:
    yard = Yard(tmp_path, cargo=True)
    first = yard.make(".venv/built", ".venv/tested")
    assert first.returncode == 0, first.stderr
    calls = yard.calls()
    assert any("-e ." in call for call in calls)
    assert yard.make(".venv/built", ".venv/tested").returncode == 0
    assert yard.calls() == calls


def test_a_changed_source_is_built_again_and_alone(tmp_path: Path) -> None:
    yard = Yard(tmp_path, cargo=True)
    assert yard.make(".venv/built").returncode == 0
    before = len(yard.calls())
    later = time.time() + 5  # clocks of file systems are coarse
    os.utime(yard.folder / "rust" / "core" / "src" / "lib.rs", (later, later))
    assert yard.make(".venv/built").returncode == 0
    new = yard.calls()[before:]
    assert len(new) == 1
    assert new[0].endswith("-e .")


@pytest.mark.parametrize("target", ["demo", "test", "wheel", "bench"])
def test_a_missing_cargo_is_told_in_one_line_before_anything_is_fetched(
    tmp_path: Path, target: str
) -> None:
    yard = Yard(tmp_path, cargo=False)
    done = yard.make(target)
    assert done.returncode != 0
    lines = [line for line in done.stderr.splitlines() if not line.startswith("make")]
    assert lines == ["cargo is missing: install Rust from https://rustup.rs, then open a new shell"]
    assert yard.calls() == []


def test_every_target_explains_itself() -> None:
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    help_text = subprocess.run(
        ["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    for target in ("demo", "test", "lint", "format", "bench", "wheel", "lock", "clean"):
        assert f"{target} " in help_text
        assert f"\n{target}:" in text


def test_the_pins_name_no_registry() -> None:
    for name in ("run", "test"):
        text = (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8")
        assert "--hash=sha256:" in text
        assert "index-url" not in text
        assert "http" not in text


@pytest.mark.skipif(sys.platform == "win32", reason="paths of the environment differ")
def test_an_old_python_is_refused(tmp_path: Path) -> None:
    yard = Yard(tmp_path, cargo=True)
    python = Path(yard.path) / "python3"
    python.write_text(f"#!{shutil.which('sh')}\nexit 1\n")  # what `python -c` then says
    done = yard.make(".venv/ready")
    assert done.returncode != 0
    assert "Python 3.11 or newer is needed" in done.stderr
