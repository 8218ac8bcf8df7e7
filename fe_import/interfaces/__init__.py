"""Interface nodes: where joints sit, and how faces follow them."""
