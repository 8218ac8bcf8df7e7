"""Virtual sensors: what instruments on a mechanism would read."""
