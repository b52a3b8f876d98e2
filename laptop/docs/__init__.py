"""The documentation: pages, their pictures, and what makes the tables in them."""
