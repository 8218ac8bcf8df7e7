"""One scene at many points of a space of parameters: points, quantities, the store, the engine."""
