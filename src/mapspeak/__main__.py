"""`python -m mapspeak` is `mapspeak`."""

from mapspeak.cli import main

main()
