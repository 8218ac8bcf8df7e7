"""Input decks of Abaqus and CalculiX: nodes, elements, sets."""
