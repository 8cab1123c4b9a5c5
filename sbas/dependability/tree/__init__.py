"""The hybrid fault tree as data: model, check, files, text, and its truth by history."""
