"""Scenes as records: what a file may say, and the checks that types cannot state."""
