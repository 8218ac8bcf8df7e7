"""Files from strangers and for users: text, TOML, HDF5."""
