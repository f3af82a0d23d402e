"""What other methods make of recordings with concealed physics, scored like tomr_gap."""
