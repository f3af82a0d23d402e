"""Recordings with and without faults: explained, diagnosed, and power residuals by regime."""
