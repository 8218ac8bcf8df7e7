"""From a link description to its finite-element model."""
