"""Hostile input for every command, made at random and judged: see attack.py."""
