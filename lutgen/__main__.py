"""``python -m lutgen`` does what ``lutgen`` does."""

from lutgen.cli import main

main()
