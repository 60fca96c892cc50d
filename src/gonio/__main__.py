"""`python -m gonio` is the command line."""

from .cli.commands import main

main()
