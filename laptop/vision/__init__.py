"""Cameras, and what their images show: markers with a confidence; colours; a sheet of them."""
