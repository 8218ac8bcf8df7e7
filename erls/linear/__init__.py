"""Mechanisms as linear systems about a state: matrices, poles, responses, diagrams."""
