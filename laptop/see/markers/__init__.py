"""What a marker looks like, where it is, and how sure that is."""
