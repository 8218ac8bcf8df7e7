"""Worker processes, and how work is shared out among them."""
