"""The developable between two rails: which point of one belongs to which point of the other."""
