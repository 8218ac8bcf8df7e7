"""What a run holds, and what is asked of it: states, files, events, stresses, watches."""
