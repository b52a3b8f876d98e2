"""How accurately an arm goes to poses and along paths, after ISO 9283, measured by cameras."""
