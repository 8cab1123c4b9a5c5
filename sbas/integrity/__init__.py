"""From a recording and its truth to errors, regions, events, availability and rates."""
