"""How to build an arm, and what a class does with it."""
