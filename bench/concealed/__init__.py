"""Recordings of the MuJoCo robot into which physics is concealed, and how reports on them score."""
