"""Lit shapes as pictures."""
