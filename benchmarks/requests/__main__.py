"""Shows the figures of every way of searching, by kind of request."""

from benchmarks.requests.measuring import main

main()
