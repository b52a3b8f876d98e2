"""What a demo and the runs on a page found: results, figures, a report."""
