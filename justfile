# Short names for ./run, which makes the environment and holds the list of checks.
# Every recipe works without just: ./run NAME.

set positional-arguments

[private]
default:
    @just --list

# Format, lint, types, architecture and tests: the whole gate
check:
    ./run check

# Everything in the gate but the tests
lint:
    ./run lint

# The import rules alone
architecture:
    ./run architecture

# The tests, all of them or as pytest is told
test *arguments:
    ./run test "$@"

# Write the files as the formatter wants them
format:
    ./run format

# The benchmarks, all of them or one
bench *arguments:
    ./run bench "$@"

# Renew the pinned versions, with uv and its flags
pins *arguments:
    ./run pins "$@"

# Watch the simulated robot, its map and its memory of places
demo *arguments:
    ./run demo "$@"
