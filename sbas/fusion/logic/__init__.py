"""Truth tables of sensor states, their Boolean forms, and the published ones."""
