"""Writes docs/formats.md from the modules of the file formats: python docs/formats.py"""

from pathlib import Path

from gonio.report.format_table import as_page, format_table

PAGE = Path(__file__).with_suffix(".md")

if __name__ == "__main__":
    PAGE.write_text(as_page(format_table()), encoding="utf-8")
