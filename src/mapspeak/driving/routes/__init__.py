"""Several places in order, planned as a whole and driven one after the other."""
