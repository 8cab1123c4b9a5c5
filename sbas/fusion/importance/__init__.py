"""Which sensor and which parameter the output hangs on."""
