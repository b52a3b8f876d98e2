"""The synthetic cameras, and the scene that they see."""
