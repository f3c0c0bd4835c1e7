"""Everything that may be wrong: laws of the catalogue, numbers of the model, sensors; and how large things are on a machine."""
