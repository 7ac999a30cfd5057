"""Importers: one file per kind of input. They read within limits and give plain values."""
