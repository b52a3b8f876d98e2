"""Scripts that pass the checks.

Above each answer, behind "# ->", stands what students begin with instead; "# <-" ends it.
"""
