"""A scene in, its run out: one run, many variants, runs made by other processes."""
