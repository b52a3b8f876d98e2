"""Drawing a job file: its strokes one by one, orders on the way, what is told of it."""
