"""Runs of chains: their answers, places of their nodes, and what their files hold."""
