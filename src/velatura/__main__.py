"""`python -m velatura` is `velatura`."""

from velatura.cli import main

main()
