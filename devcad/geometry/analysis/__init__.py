"""What a space curve is: its invariants, its class, and the developables attached to it."""
