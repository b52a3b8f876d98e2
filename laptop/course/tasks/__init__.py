"""What students begin with: each fails its check."""
