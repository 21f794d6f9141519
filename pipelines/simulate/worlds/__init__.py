"""Kinds of worlds and the buildings in them: what there is to see, and who looks at it."""
