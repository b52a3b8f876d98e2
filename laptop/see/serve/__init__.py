"""The loop over the frames of all cameras, and the server of the link to the brick."""
