"""The experiments of Wang 2024, figure by figure; `bench/experiments.py` runs them."""
