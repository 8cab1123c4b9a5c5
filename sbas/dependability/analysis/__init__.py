"""What the figures of a hybrid fault tree mean: importance, sensitivity, uncertainty, sequences."""
