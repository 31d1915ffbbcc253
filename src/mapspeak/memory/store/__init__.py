"""The semantic map file as text: read with the place of every fault, edited with comments kept.

Nothing here opens a file; `mapspeak.memory.store.semanticmap` does.
"""
