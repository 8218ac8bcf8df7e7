"""What a run states about its own error, and whether it can be relied on."""
