"""Graphs as source text of other languages."""
