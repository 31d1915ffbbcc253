"""The page of a run: the paper's table with ours beside it, and every trial to be replayed."""
