"""Numbers of a scene from measured records, with what the records leave open."""
