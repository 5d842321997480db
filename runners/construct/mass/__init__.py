"""Mass properties, and the mass along the vehicle."""
