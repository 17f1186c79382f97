"""Write the licences of every crate that is compiled into the wheel to LICENSE-THIRD-PARTY.

Needs nothing but cargo: `cargo tree` names the crates, `cargo metadata` the folders of
their sources.
"""

import json
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = "lidar-deflect-python"
PATTERNS = ("LICENSE*", "LICENCE*", "COPYING*", "NOTICE*", "license*")
HEAD = """\
The compiled part of lidar-deflect contains the libraries below, each under its own licence.
The report contains plotly.js (MIT), whose notice stands at the head of its script.
"""


def cargo(*arguments: str) -> str:
    command = ["cargo", *arguments, "--locked"]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def compiled_in() -> set[tuple[str, str]]:
    """Return name and version of the crates that the extension links on this platform."""
    tree = cargo("tree", "-p", PACKAGE, "-e", "normal", "--prefix", "none", "--format", "{p}")
    found = (line.split() for line in tree.splitlines() if line.strip())
    return {(words[0], words[1].removeprefix("v")) for words in found}


def texts(package: dict[str, Any]) -> list[str]:
    folder = Path(package["manifest_path"]).parent
    files = sorted({path for pattern in PATTERNS for path in folder.glob(pattern)})
    return [path.read_text(encoding="utf-8", errors="replace").strip() for path in files]


def main() -> int:
    wanted = compiled_in()
    packages = [
        package
        for package in json.loads(cargo("metadata", "--format-version", "1"))["packages"]
        if (package["name"], package["version"]) in wanted and package["source"] is not None
    ]
    lines, users = [HEAD], defaultdict(list)
    for package in sorted(packages, key=lambda package: str(package["name"])):
        name = f"{package['name']} {package['version']}"
        found = texts(package)
        if not found and not package["license"]:
            print(f"{name}: neither licence nor licence file", file=sys.stderr)
            return 1
        note = "" if found else " (no licence file in its package)"
        lines.append(f"{name}: {package['license'] or 'see below'}{note}")
        for text in found:
            users[text].append(name)
    for text, names in users.items():
        lines += ["", "=" * 80, ", ".join(names), "=" * 80, "", text]
    (ROOT / "LICENSE-THIRD-PARTY").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
