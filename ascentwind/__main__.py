"""``python -m ascentwind``: the command line."""

from .runners.cli.entry import main

main()
