"""Recordings with and without faults: explained, diagnosed, power residuals by regime; and
faults to draw for drives in MuJoCo."""
