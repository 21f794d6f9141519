"""Containers of logs: bytes in files to channels and their messages as bytes, whatever wrote them."""
