"""Output files, refused early and written completely or not at all."""
