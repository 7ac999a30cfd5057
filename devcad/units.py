"""Lengths: the only place that knows an inch.

Inside devcad every length is in millimetres and every angle in radians.
"""

from __future__ import annotations

MM_PER_INCH = 25.4  # exact, by definition since 1959

MM_PER_UNIT = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": MM_PER_INCH}
METRES_PER_MM = 1e-3  # glTF speaks metres
