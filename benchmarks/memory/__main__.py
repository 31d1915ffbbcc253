"""Shows every building."""

from benchmarks.memory.measuring import main

main()
