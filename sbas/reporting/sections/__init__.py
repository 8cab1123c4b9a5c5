"""The report's sections: one pure function `section(evaluation) -> Section` a file."""
