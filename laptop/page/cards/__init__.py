"""The parts of one browser's page: a module for each card, the stylesheet and the script."""
