"""Worlds, robots and sensors: logs with a known truth, from forward models that share nothing with the estimators.

``world`` reads a file into one of ``worlds``, which builds a ``scene``; ``simulate`` lets its ``robot`` drive and
merges what its ``sensors`` say, the pictures among them, by ``renderer``, ``shapes`` and ``kernels``; ``write`` writes
the log and what stands beside it. ``pose`` and ``camera`` are the geometry of all of them.
"""
