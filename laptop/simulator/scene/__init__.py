"""What a synthetic camera sees."""
