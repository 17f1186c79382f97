"""Benches: how fast, how right. Run from the project's folder."""
