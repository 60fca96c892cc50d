"""C99: directions are arrays of three; large tables are pointers that the program sets."""

from ..language import Language

LANGUAGE = Language()
