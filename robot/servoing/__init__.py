"""Visual servoing: what was seen becomes where the joints go."""
