"""The demo: everything at once, on this machine alone, and a check of whether it truly worked.

In: an arm's file and a seed.  Out: a run folder with lines, servo runs, and a verdict on each.
Begin with `demo_run`.

demo_run   the stages in order
goals      a scene and goals that the arm can reach
processes  programs that it starts, and their deadlines
progress   what a terminal shows meanwhile
truth      what the emulation knows of the tip
results    outcomes, and the run's record
"""
