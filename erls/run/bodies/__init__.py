"""What scenes of bodies give: motions, equilibria, buckling loads, frequencies."""
