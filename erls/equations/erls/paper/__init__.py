"""ERLS-CMS in the notation of the paper: compatibility C q = 0, pseudo-inverse, D, G, link inertia; dense."""
