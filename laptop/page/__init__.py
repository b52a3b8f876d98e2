"""The page: watch, pick, aim, start, stop; a web page, in a process of its own."""
