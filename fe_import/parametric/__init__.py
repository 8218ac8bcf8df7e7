"""Families of reduced links: one basis for all values of some numbers, matrices interpolated between samples."""
