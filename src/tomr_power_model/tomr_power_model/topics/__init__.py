"""Which topics the stages read and publish, and what becomes of each message."""
