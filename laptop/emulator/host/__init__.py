"""The brick's Linux as a script has it: time, threads, processes; the cost of computing."""
