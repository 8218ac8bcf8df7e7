"""Scenes as functional mock-up units: packages, the process behind them, and in ``sources`` their C."""
