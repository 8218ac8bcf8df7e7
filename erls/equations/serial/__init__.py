"""What formulations of chains share: joint motion, drives, gains, curves, feed-forward, packing."""
