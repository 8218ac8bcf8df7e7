"""Studies: many runs of one scene, compared."""
