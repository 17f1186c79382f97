"""How right is it? Simulated tests with truth, many of them, both methods on the same captures.

``python -m benches.accuracy run`` runs what is missing; ``report -o docs/accuracy.md`` writes the
page.
"""
