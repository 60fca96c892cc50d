"""Benchmarks that asv runs: what tests count (tests/house/counts.txt), at real sizes, in time. See compare.py."""
