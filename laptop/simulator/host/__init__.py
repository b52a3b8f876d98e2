"""What the brick's Linux is to a script: time, threads, processes; what computing costs."""
