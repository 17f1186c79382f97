"""``python -m benches.accuracy run|report|one``."""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

from benches.accuracy import campaign, kinds, one, page

ROOT = Path(__file__).parents[2]
RUNS = ROOT / "target" / "accuracy"
PAGE = ROOT / "docs" / "accuracy.md"


def main(arguments: list[str] | None = None) -> int:
    """Run one of the three."""
    parser = argparse.ArgumentParser(prog="python -m benches.accuracy", description=__doc__)
    verbs = parser.add_subparsers(dest="verb", required=True)
    for verb in ("run", "report"):
        options = verbs.add_parser(verb)
        options.add_argument("--split", choices=sorted(kinds.FIRST_SEED), default="development")
        options.add_argument("--count", type=int, default=200)
        options.add_argument(
            "--runs", type=Path, help="file of records; default in target/accuracy"
        )
        options.add_argument("--methods", default=",".join(one.known_methods()))
        if verb == "run":
            options.add_argument("-j", "--jobs", type=int, default=os.cpu_count() or 1)
            options.add_argument("--timeout", type=float, default=600.0, help="seconds per test")
        else:
            options.add_argument(
                "-o", "--out", type=Path, help=f"page to write, such as {PAGE.name}"
            )
    single = verbs.add_parser("one")
    single.add_argument("id")
    single.add_argument("--methods", default=",".join(one.known_methods()))
    given = parser.parse_args(arguments)
    return {"run": _run, "report": _report, "one": _one}[given.verb](given)


def _file(given: argparse.Namespace) -> Path:
    return given.runs or RUNS / f"{given.split}.jsonl"


def _run(given: argparse.Namespace) -> int:
    path, methods = _file(given), given.methods.split(",")
    ids = [case.id for case in kinds.cases(given.split, given.count)]
    open_ids = campaign.missing(ids, campaign.done(path), methods)
    print(f"{len(ids)} tests, {len(open_ids)} to run, into {path}", file=sys.stderr)
    start = [sys.executable, "-m", "benches.accuracy", "one", "--methods", given.methods]
    campaign.run(
        open_ids,
        lambda i: [*start, i],
        path,
        asked=methods,
        jobs=given.jobs,
        timeout_s=given.timeout,
    )
    return _report(given)


def _one(given: argparse.Namespace) -> int:
    record = one.run(kinds.named(given.id), given.methods.split(","))
    print(json.dumps(record))
    return 0


def _report(given: argparse.Namespace) -> int:
    ids = [case.id for case in kinds.cases(given.split, given.count)]
    known = campaign.done(_file(given))
    records = [known[i] for i in ids if i in known]
    if not records:
        print(f"no records in {_file(given)}", file=sys.stderr)
        return 3
    command = f"python -m benches.accuracy run --split {given.split} --count {given.count}"
    tables = RUNS / "registration.md"
    registration = tables.read_text(encoding="utf-8") if tables.is_file() else None
    text = page.markdown(records, given.split, command, registration)
    if getattr(given, "out", None):
        given.out.write_text(text, encoding="utf-8")
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
