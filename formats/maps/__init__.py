"""Maps and places that a run is given: landmarks, stripe marks, waypoints."""
