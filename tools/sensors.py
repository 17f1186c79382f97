"""Put the table of sensors of the compiled core on their page; ``--check`` only compares."""

import sys
from pathlib import Path

from lidar_deflect._native import sensor_table

PAGE = Path(__file__).parents[1] / "docs" / "sensors.md"
START = "<!-- table: made by tools/sensors.py from rust/core/src/packet/proof -->"
END = "<!-- end of table -->"
HEADER = ("id", "sensor", "recognised by", "returns", "calibration of the unit", "proven by")


def page(text: str) -> str:
    """Give the page with the current table."""
    before, rest = text.split(START)
    _, after = rest.split(END)
    rows = [[f"`{name}`", *cells] for name, *cells in sensor_table()]
    lines = [HEADER, ["---"] * len(HEADER), *rows]
    table = "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
    return f"{before}{START}\n{table}\n{END}{after}"


def main() -> int:
    """Write or check the page; 1 where it was not current."""
    found = PAGE.read_text(encoding="utf-8")
    current = page(found)
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(current, encoding="utf-8")
        return 0
    return int(found != current)


if __name__ == "__main__":
    sys.exit(main())
