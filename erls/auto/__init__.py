"""Which effects a scene needs: probed before a run, certified after it."""
