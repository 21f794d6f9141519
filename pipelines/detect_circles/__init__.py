"""Round lamps and stickers in images of a ceiling."""
