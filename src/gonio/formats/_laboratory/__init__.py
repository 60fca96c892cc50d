"""Shared by the readers of laboratories' tables, CSV and Excel: where the table is, and what its columns mean."""
