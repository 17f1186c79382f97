"""``python -m benches.accuracy.registration run|report|batch``."""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

from benches.accuracy import campaign
from benches.accuracy.registration import one, table, yards

RUNS = Path(__file__).parents[3] / "target" / "accuracy"
BATCH = 10
"""Yards of one process: starting one takes as long as a yard."""


def main(arguments: list[str] | None = None) -> int:
    """Run one of the three."""
    parser = argparse.ArgumentParser(prog="python -m benches.accuracy.registration")
    verbs = parser.add_subparsers(dest="verb", required=True)
    for verb in ("run", "report"):
        options = verbs.add_parser(verb)
        options.add_argument("--split", choices=sorted(yards.FIRST_SEED), default="development")
        options.add_argument("--count", type=int, default=1000)
        options.add_argument("-j", "--jobs", type=int, default=os.cpu_count() or 1)
    batch = verbs.add_parser("batch")
    batch.add_argument("split", choices=sorted(yards.FIRST_SEED))
    batch.add_argument("first", type=int)
    given = parser.parse_args(arguments)
    if given.verb == "batch":
        numbers = range(given.first, given.first + BATCH)
        print(json.dumps({"yards": [one.run(yards.case(given.split, n)) for n in numbers]}))
        return 0
    path = RUNS / f"registration-{given.split}.jsonl"
    firsts = {f"{given.split}-{n:05d}": n for n in range(0, given.count, BATCH)}
    if given.verb == "run":
        open_ids = campaign.missing(firsts, campaign.done(path), ["registration"])
        print(f"{given.count} yards, {BATCH * len(open_ids)} to run, into {path}", file=sys.stderr)
        start = [sys.executable, "-m", "benches.accuracy.registration", "batch", given.split]
        campaign.run(
            open_ids,
            lambda i: [*start, str(firsts[i])],
            path,
            asked=["registration"],
            jobs=given.jobs,
            timeout_s=60.0 * BATCH,
        )
    known = campaign.done(path)
    records = [yard for i in firsts for yard in _yards(given.split, firsts[i], known.get(i))]
    text = table.markdown(records, given.split)
    RUNS.mkdir(parents=True, exist_ok=True)
    (RUNS / "registration.md").write_text(text + "\n", encoding="utf-8")
    print(text)
    return 0


def _yards(split: str, first: int, batch: dict[str, object] | None) -> list[dict[str, object]]:
    """Return the yards of a batch; of one that crashed, each as failed."""
    if batch is None:
        return []
    if isinstance(yard_records := batch.get("yards"), list):
        return yard_records
    cases = (yards.case(split, number) for number in range(first, first + BATCH))
    return [
        {"yard": case.yard, "sensor": case.sensor, "failed": batch.get("failed", "crashed")}
        for case in cases
    ]


if __name__ == "__main__":
    sys.exit(main())
