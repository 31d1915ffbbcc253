"""Lists the goals that were not answered rightly."""

from benchmarks.relations.measuring import main

main()
