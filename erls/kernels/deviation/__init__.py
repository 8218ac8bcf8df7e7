"""The error that leaving out effects makes, followed along a computed motion."""
