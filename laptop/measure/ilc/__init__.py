"""A camera teaches the arm a path: iterative learning control."""
