"""What is looked at during and after a run, so that nobody trusts a result beyond the range of its model."""
