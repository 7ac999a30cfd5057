"""Fabrication: what the workshop's sheets can bear."""
