"""The methods, the models they share, and the engine that chains them."""
