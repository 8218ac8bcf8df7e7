"""How far off links are that bend: what orders beyond those of their model would make of the motion of a run."""
