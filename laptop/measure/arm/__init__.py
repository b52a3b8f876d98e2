"""An arm's own numbers, from where a camera saw its marker while the joints were told apart."""
