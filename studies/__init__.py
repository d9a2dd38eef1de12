"""Studies: one question, one file. In a wheel they are the package ``deboom.studies``."""
