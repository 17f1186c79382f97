"""Pictures of a report for docs/gallery.md: python tools/gallery.py REPORT.html FOLDER."""

import base64
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from browser import CHROMIUM, Browser, browser  # noqa: E402

WIDTH = 1100
# name, what of the page, dark or light
PICTURES = (
    ("result", "#result", False),
    ("verdict", ".verdict", False),
    ("curves", "#curves figure", False),
    ("replay", ".replay", False),
    ("replay-dark", ".replay", True),
    ("load", "#load figure", False),
    ("shapes", "#shapes figure", True),
    ("comparison", "#comparison figure", False),
    ("calibration", "#calibration figure", False),
    ("health", "#health figure", False),
)


def picture(page: Browser, selector: str, path: Path) -> None:
    """Save one element of the page."""
    box = page.run(
        f"(() => {{ const box = document.querySelector({selector!r}).getBoundingClientRect();"
        "return [box.left + scrollX, box.top + scrollY, box.width, box.height]; })()"
    )
    clip = dict(zip(("x", "y", "width", "height"), box, strict=True)) | {"scale": 1}
    data = page.send("Page.captureScreenshot", clip=clip, captureBeyondViewport=True)["data"]
    path.write_bytes(base64.b64decode(data))


def main() -> int:
    if CHROMIUM is None:
        print("gallery: no chromium here; the pictures stay as they are", file=sys.stderr)
        return 0
    report, out = Path(sys.argv[1]), Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    with browser() as page:
        for dark in (False, True):
            page.open(report, width=WIDTH, dark=dark)
            page.run("window.drawAllFigures()")
            page.run("(() => { const r = document.querySelector('.replay').replay;"
                     "r.show(r.data.largest); })()")  # fmt: skip
            time.sleep(2.0)  # figures are drawn in turns of the browser's own
            for name, selector, is_dark in PICTURES:
                if is_dark == dark and page.run(f"!!document.querySelector({selector!r})"):
                    picture(page, selector, out / f"{name}.png")
    print("\n".join(str(path) for path in sorted(out.glob("*.png"))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
