"""Link descriptions (TOML): schema, defaults, checks."""
