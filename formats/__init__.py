"""Bytes to events and products, and back; no algorithm; the only place that opens files."""
