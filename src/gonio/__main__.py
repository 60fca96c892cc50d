"""`python -m gonio` is the command line."""

from .cli import main

main()
